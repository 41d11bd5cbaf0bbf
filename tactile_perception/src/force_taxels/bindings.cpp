// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Force taxels for Python, as module _core.force_taxels. A sensor has N taxels.
#include "bindings/bindings.hpp"

#include "bindings/border.hpp"
#include "force_taxels/skin.hpp"
#include "force_taxels/slip.hpp"

namespace tactile::border {

using namespace force_taxels;

static Skin made_skin(const Rows& positions, const Rows& normals, const Array<double>& axes, const Array<std::int64_t>& neighbours,
                      double pitch) {
    for (std::ptrdiff_t k = 0; k < neighbours.size; ++k) within(neighbours[k], "neighbours", 0, static_cast<double>(positions.rows() - 1));
    return Skin({positions, normals, Eigen::Map<const Rows>(axes.data, axes.size / 3, 3), neighbours.vector(), pitch});
}

static void bind_force_taxels(py::module_& parent) {
    py::module_ module = parent.def_submodule("force_taxels", "Taxels that measure force vectors: contacts, wrench and slip.");
    class_of<Touch>(module, "Touch", "Connected taxels that press: src/force_taxels/skin.hpp.", {"outline (M, 3)"});
    class_of<Touches>(module, "Touches", "Contacts of a frame, each and all together, and the labels (N) of taxels, 0 outside.");
    auto skin = class_of<Skin>(module, "Skin", "Taxels on flat and curved patches: src/force_taxels/skin.hpp.");
    determine<Skin> = [](const Skin& one, Lengths& of) { of['N'] = one.count(); };
    init(skin, {"positions (N, 3)", "normals (N, 3)", "axes (N, 3, 3)", "neighbours (N, K)", "pitch [1e-9, 1e6]"}, made_skin);
    def(skin, "touched -> (N) bool", "Taxels that bear the object.", {"press (N)", "probability (N)"}, &Skin::touched);
    def(skin, "beside -> (N) bool", "Taxels with a neighbour in a mask, and those in it.", {"mask (N)"}, &Skin::beside);
    def(skin, "contacts", "Touches.", {"components (N, 3)", "variance (N, 3)", "touched (N)"}, &Skin::contacts);
    def(skin, "wrench", "Wrench (6) at the origin, and its covariance (6, 6). error: relative standard deviation of the force of a taxel.",
        {"components (N, 3)", "variance (N, 3)", "touched (N)", "alive (N)", "error [0, 1e6]"}, &Skin::wrench);

    record<SlipLimits>(module, "SlipLimits", "What decides of slip, each with what it is: src/force_taxels/slip.hpp.",
                       {"same unchanged forgotten [0, 1]", "load_s steady_s median skewed texture_s [1e-6, 1e6]", "factor [1.001, 1e6]",
                        "outlier [1e-30, 1]", "[0, 1e6]"});
    using F = SlipFilter;
    auto filter = class_of<F>(module, "SlipFilter", "Which taxels slip, by the friction that slips show: src/force_taxels/slip.hpp.");
    determine<F> = [](const F& one, Lengths& of) { of['N'] = one.count(); };
    get(filter, "friction", "mean of the coefficient", &F::friction);
    get(filter, "friction_sigma", "its standard deviation", &F::friction_sigma);
    const auto made = [](const std::vector<double>& tilt, const SlipLimits& limits) { return F(tilt, limits); };
    init(filter, {"tilt (N)", "limits"}, made, SlipLimits());
    def(filter, "reset", "Starts again without a history; what is known of friction is kept.", {}, &F::reset);
    using Numbers = const double*;
    using Mask = const std::uint8_t*;
    def(filter, "update -> (N)", "Probability that each taxel slips, interval s after the last frame: src/force_taxels/slip.hpp.",
        {"force (N, 3)", "noise (N, 3)", "offset (N, 3)", "touched (N)", "is_new (N)", "interval [0, 1e30]"},
        [](F& one, Numbers force, Numbers noise, Numbers offset, Mask touched, Mask is_new, double interval) {
            return one.update({force, noise, offset, touched, is_new}, interval);
        });
}

static const Subject SUBJECT("force_taxels", bind_force_taxels);

}  // namespace tactile::border
