// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Force taxels for Python, as module _core.force_taxels. A sensor has N taxels.
#include "bindings/bindings.hpp"

#include "bindings/border.hpp"
#include "force_taxels/skin.hpp"
#include "force_taxels/slip.hpp"

namespace tactile::force_taxels {

inline void determine(const SlipFilter& filter, border::Lengths& of) {
    of['N'] = filter.count();
}
inline void determine(const Skin& skin, border::Lengths& of) {
    of['N'] = skin.count();
}

}  // namespace tactile::force_taxels

namespace tactile::border {
namespace {

using namespace force_taxels;
using Bytes = const std::uint8_t*;
using Doubles = const double*;

Skin made_skin(const Rows& positions, const Rows& normals, const Array<double>& axes, const Array<std::int64_t>& neighbours,
               double pitch) {
    for (std::ptrdiff_t k = 0; k < neighbours.size; ++k) within(neighbours[k], "neighbours", 0, static_cast<double>(positions.rows() - 1));
    return Skin({positions, normals, Eigen::Map<const Rows>(axes.data, axes.size / 3, 3), neighbours.vector(), pitch});
}

void bind_skin(py::module_& module) {
    using T = Touch;
    class_of<T>(module, "Touch", "Connected taxels that press: src/force_taxels/skin.hpp.", get("label", &T::label),
                get("count", &T::count, "of taxels"), get("position (3)", &T::position, "m, centre of pressure"),
                get("normal (3)", &T::normal), get("force (3)", &T::force, "of the object"),
                get("covariance (3, 3)", &T::covariance, "m^2, of the position"), get("normals (3)", &T::normals, "sum"),
                get("positions (3)", &T::positions, "m, sum"), get("squares (3)", &T::squares, "m^2, sums of xx, xy and yy"),
                get("outline (M, 3)", &T::outline, "m, convex hull of its cells"));
    class_of<Touches>(module, "Touches", "Contacts of a frame.", get("each", &Touches::each, "list of Touch"),
                      get("all", &Touches::all, "Touch of all taxels that touch"), get("labels (N)", &Touches::labels, "0 outside"));
    auto skin = class_of<Skin>(module, "Skin", "Taxels on flat and curved patches: src/force_taxels/skin.hpp.");
    init(skin, made_skin, "positions (N, 3)", "normals (N, 3)", "axes (N, 3, 3)", "neighbours (N, K)", "pitch [1e-9, 1e6]");
    def(skin, "touched -> (N) bool", "Taxels that bear the object: more likely than not, and more than the elastomer carries over.",
        &Skin::touched, "press (N)", "probability (N)");
    def(skin, "beside -> (N) bool", "Taxels with a neighbour in a mask, and those in it.", &Skin::beside, "mask (N)");
    def(skin, "contacts", "Touches of a frame; variance: of components.", &Skin::contacts, "components (N, 3)", "variance (N, 3)",
        "touched (N)");
    def(
        skin, "wrench", "Wrench (6) at the origin, and its covariance (6, 6). error: relative standard deviation of the force of a taxel.",
        [](const Skin& one, Doubles components, Doubles variance, Bytes touched, Bytes alive, double error) {
            return one.wrench(components, variance, touched, alive, error);
        },
        "components (N, 3)", "variance (N, 3)", "touched (N)", "alive (N)", "error [0, 1e6]");
}

}  // namespace

static void bind_force_taxels(py::module_& parent) {
    py::module_ module = parent.def_submodule("force_taxels", "Taxels that measure force vectors: contacts, wrench and slip.");
    bind_skin(module);
    using L = SlipLimits;
    record(module, "SlipLimits", "What decides of slip, each with what it is: src/force_taxels/slip.hpp.",
           field("changes [0, 1e6]", &L::changes), field("stops [0, 1e6]", &L::stops), field("same [0, 1]", &L::same),
           field("creep [0, 1e6]", &L::creep), field("texture [0, 1e6]", &L::texture), field("unchanged [0, 1]", &L::unchanged),
           field("load_s [1e-6, 1e6]", &L::load_s), field("steady_s [1e-6, 1e6]", &L::steady_s), field("median [1e-6, 1e6]", &L::median),
           field("factor [1.001, 1e6]", &L::factor), field("uneven [0, 1e6]", &L::uneven), field("skewed [1e-6, 1e6]", &L::skewed),
           field("texture_s [1e-6, 1e6]", &L::texture_s), field("forgotten [0, 1]", &L::forgotten),
           field("outlier [1e-30, 1]", &L::outlier));
    using F = SlipFilter;
    auto filter = class_of<F>(module, "SlipFilter",
                              "Which taxels slip, with the coefficient of friction that slips show: src/force_taxels/slip.hpp.",
                              get("friction", &F::friction, "mean of the coefficient"),
                              get("friction_sigma", &F::friction_sigma, "its standard deviation"),
                              get("moving", &F::moving, "probability that the object moves"));
    init(
        filter, [](const Array<double>& tilt, const L& limits) { return F(tilt.vector(), limits); }, "tilt (N)",
        py::arg_v("limits", L{}, "SlipLimits()"));
    def(filter, "reset", "Starts again without a history; what is known of friction is kept.", &F::reset);
    def(
        filter, "update -> (N)",
        "Probability that each taxel slips. force: two tangential components and the pressing one; noise, offset: variance of white\n"
        "noise, and of the untouched reading; is_new: whether the reading is not that of the last frame; interval: s since then.",
        [](F& one, const double* force, const double* noise, const double* offset, Bytes touched, Bytes is_new, double interval) {
            return one.update({force, noise, offset, touched, is_new}, interval);
        },
        "force (N, 3)", "noise (N, 3)", "offset (N, 3)", "touched (N)", "is_new (N)", "interval [0, 1e30]");
}

static const Subject SUBJECT("force_taxels", bind_force_taxels);

}  // namespace tactile::border
