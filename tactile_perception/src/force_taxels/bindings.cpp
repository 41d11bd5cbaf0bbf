// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Force taxels for Python, as module _core.force_taxels. A sensor has N taxels.
#include "bindings/bindings.hpp"

#include "bindings/border.hpp"
#include "force_taxels/slip.hpp"

namespace tactile::force_taxels {

inline void determine(const SlipFilter& filter, border::Lengths& of) {
    of['N'] = filter.count();
}

}  // namespace tactile::force_taxels

namespace tactile::border {
namespace {

using namespace force_taxels;
using Bytes = const std::uint8_t*;

}  // namespace

void bind_force_taxels(py::module_& parent) {
    py::module_ module = parent.def_submodule("force_taxels", "Taxels that measure force vectors: slip.");
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
        filter, [](std::int64_t count, const L& limits) { return F(count, limits); }, "count [1, 1e6]",
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

}  // namespace tactile::border
