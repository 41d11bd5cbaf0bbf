// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Dots for Python, as module _core.dots.
#include "bindings/bindings.hpp"

#include "bindings/border.hpp"
#include "common/rows.hpp"
#include "dots/blobs.hpp"
#include "dots/deviation.hpp"
#include "dots/discs.hpp"
#include "dots/finder.hpp"
#include "dots/lattice.hpp"
#include "dots/likely.hpp"
#include "dots/links.hpp"

namespace tactile::border {
namespace {

using Bytes = Array<std::uint8_t>;
using Doubles = Array<double>;

Image as_image(const Bytes& image) {
    return {image, image.length(0), image.length(1)};
}

// The tables of tactile_perception.dots.fit.DiscModel: a DiscModel's members of the same names.
std::shared_ptr<const DiscModel> as_model(const py::object& given) {
    Attributes of{given};
    const auto floats = [&](const char* line) { return of.take<Array<float>>(line).get().vector(); };
    const auto doubles = [&](const char* line) { return of.take<Doubles>(line).get().vector(); };
    static_assert(ESTIMATES == 5 && DIMENSIONS == 32 && MODES == 10 && LARGEST_HALF == 30);
    DiscModel model{};
    model.half = of.take<py::ssize_t>("half [1, 30]").get();
    of.lengths['B'] = (model.half + 1) * (model.half + 1);
    model.smallest = of.take<double>("smallest [0.1, 100]").get();
    model.largest = within(of.take<double>("largest").get(), "largest", model.smallest + 1e-3, 200);
    model.blur = of.take<double>("blur [0, 100]").get();
    model.estimators = floats("estimators (S=2..1000000, P=2..1000000, P, 5, 32)");
    model.diameters = of.lengths['S'], model.phases = of.lengths['P'];
    model.basis = floats("basis (B, 32)"), model.modes = floats("modes (S, P, P, 10, 32)");
    model.gains = doubles("gains (S, P, P)"), model.levers = doubles("levers (S, 2)");
    model.profile = floats("profile (N=2..1000000, L=2..1000000)");
    model.profiles = of.lengths['N'], model.profile_length = of.lengths['L'];
    model.per_square = of.take<double>("per_square [1e-3, 1e3]").get();
    return std::make_shared<DiscModel>(std::move(model));
}

// The numbers of tactile_perception.dots.appearance.Appearance.
DotLook as_look(const py::object& given) {
    Attributes of{given};
    const auto number = [&](const char* line) { return of.take<double>(line).get(); };
    return {number("typical [0.5, 100]"), number("contrast [-1e6, 1e6]"), static_cast<int>(std::nearbyint(number("ground [0, 255]"))),
            number("noise [0, 1e6]"), static_cast<int>(number("step [1, 1e3]"))};
}

// A member of each of several results; positions: of u and v.
template <class Result, class... Member>
std::vector<double> each(const std::vector<Result>& results, Member... members) {
    std::vector<double> found;
    for (const Result& one : results) (found.push_back(one.*members), ...);
    return found;
}

Blobs blobs(const Bytes& image, const Bytes& small, const Array<std::uint16_t>& labels, const Array<std::int32_t>& box,
            const Doubles& centre, const Array<std::uint16_t>& label) {
    std::vector<BlobRegion> regions;
    for (py::ssize_t n = 0; n < box.length(); ++n) {
        const std::int32_t* at = box + 4 * n;
        for (int axis = 0; axis < 2; ++axis) {
            const double length = static_cast<double>(small.length(1 - axis));
            within(at[axis], "box", 1, length - 2);
            within(at[2 + axis], "box", 1, length - 1 - at[axis]);
        }
        regions.push_back({at[0], at[1], at[2], at[3], centre[2 * n], centre[2 * n + 1], label[n]});
    }
    const int step = small.length(0) == image.length(0) && small.length(1) == image.length(1) ? 1 : 2;
    return fit_blobs(as_image(image), as_image(small), step, labels, regions);
}

// Rows of column, row, correlation, amplitude and ground.
std::vector<double> rows_of(const std::vector<FoundDisc>& discs) {
    std::vector<double> rows;
    rows.reserve(5 * discs.size());
    for (const FoundDisc& disc : discs)
        for (const double value :
             {static_cast<double>(disc.column), static_cast<double>(disc.row), disc.correlation, disc.amplitude, disc.ground})
            rows.push_back(value);
    return rows;
}

using Floats = Array<float>;
using Indices = Array<std::int64_t>;

std::vector<double> discs_at(const Floats& image, const Floats& disc, const Floats& both, const Indices& column, const Indices& row) {
    for (py::ssize_t i = 0; i < column.size; ++i) {
        within(column[i], "column", 0, static_cast<double>(image.length(1) - 1));
        within(row[i], "row", 0, static_cast<double>(image.length(0) - 1));
    }
    within(disc.length() % 2, "disc", 1, 1);
    return rows_of(correlate({image, image.length(0), image.length(1)}, column, row, column.size, {disc, both, disc.length()}));
}

std::vector<double> discs_of(const Floats& image, const Floats& relief, const Floats& disc, const Floats& both, int sign,
                             py::ssize_t margin, py::ssize_t reach, double height, double contrast, double correlation, py::ssize_t most) {
    within(disc.length() % 2, "disc", 1, 1);
    return rows_of(find_discs({image, image.length(0), image.length(1)}, relief, {disc, both, disc.length()},
                              {sign, margin, reach, height, contrast, correlation, most}));
}

TrackLinks links(const Rows2& last, const Rows2& predicted, const Rows2& first, const Array<bool>& seen, const Rows2& dots,
                 const std::array<double, 2>& size) {
    for (const double length : size) within(length, "size", 0, INFINITY);
    const TracksBefore tracks{last.transpose(), predicted.transpose(), first.transpose(), {seen.data, seen.data + seen.size}};
    within(std::count(tracks.seen.begin(), tracks.seen.end(), 1), "seen", 1, 1e6);
    return link_tracks(tracks, dots.transpose(), {size[0], size[1]});
}

}  // namespace

static void bind_dots(py::module_& parent) {
    py::module_ module = parent.def_submodule("dots", "Dots: detection, and their lattice.");
    using F = FoundDots;
    class_of<F>(module, "FoundDots", "Dots of an image.",
                get(
                    "uv (N, 2)", [](const F& one) { return each(one.dots, &Dot::u, &Dot::v); }, "px"),
                get(
                    "area (N)", [](const F& one) { return each(one.dots, &Dot::area); }, "px^2"),
                get(
                    "sigma (N)", [](const F& one) { return each(one.dots, &Dot::sigma); }, "px, per axis"),
                get("candidates (N, 2)", &F::candidates, "px, of peaks that were fitted"),
                get("outgrown", &F::outgrown, "whether larger ones than the model's were left out"));
    using L = DotLimits;
    record(module, "DotLimits", "What decides what is a dot: docs/constants.md.", field("same", &L::same), field("met", &L::met),
           field("farthest", &L::farthest), field("faintest", &L::faintest), field("noise", &L::noise), field("plain", &L::plain),
           field("usual", &L::usual), field("unlikest", &L::unlikest));
    auto finder = class_of<DotFinder>(
        module, "DotFinder",
        "Finds dots by a maximum-likelihood fit of each candidate, and rejects what is no dot. model: dots.fit.DiscModel; look:\n"
        "dots.appearance.Appearance; limits: DotLimits. It can be copied.");
    init(
        finder,
        [](const py::object& model, const py::object& look, const L& limits) { return DotFinder(as_model(model), as_look(look), limits); },
        "model", "look", py::arg_v("limits", L(), "DotLimits()"));
    def(
        finder, "find", "Dots of an image, reduced as the look says, in px of the whole image.",
        [](const DotFinder& one, const Bytes& image) { return one.find(as_image(image)); }, "image (H, W)");
    using B = Blobs;
    class_of<B>(module, "Blobs", "Large bright markers.",
                get(
                    "uv (N, 2)", [](const B& one) { return each(one.blobs, &Blob::u, &Blob::v); }, "px"),
                get(
                    "area (N)", [](const B& one) { return each(one.blobs, &Blob::area); }, "px^2"),
                get(
                    "sigma (N)", [](const B& one) { return each(one.blobs, &Blob::sigma); }, "px, per axis"),
                get(
                    "amplitude (N)", [](const B& one) { return each(one.blobs, &Blob::amplitude); }, "grey levels over the ground"),
                get(
                    "solidity (N)", [](const B& one) { return each(one.blobs, &Blob::solidity); },
                    "area over that of the ellipse with the same second moments"),
                get("blur", &B::blur, "px, of the edges"));
    def(module, "fit_blobs",
        "Large bright markers of an image, by moments of weights that rise from ground to plateau on a marker's edge.\n\n"
        "small: the image itself or reduced by 2; labels: its regions, grown by a pixel; box: left, top, width, height of the regions as\n"
        "they were, inside it by a pixel or more; centre, label: of each region.",
        blobs, "image (G, V)", "small (H, W)", "labels (H, W)", "box (N, 4)", "centre (N, 2) [-1e12, 1e12]", "label (N)");
    class_of<Lattice>(module, "Lattice", "Relative indices of dots on a printed grid.",
                      get("found", &Lattice::found, "whether the dots form a grid that does not contradict itself"),
                      get("rc (N, 2)", &Lattice::rc, "row and column, valid for members"), get("member (N) bool", &Lattice::member),
                      get("angle", &Lattice::angle, "rad, of the rows from u"), get("pitch", &Lattice::pitch, "px"));
    def(module, "discs_at -> (N, 5)",
        "Column, row, correlation, amplitude and ground of bright discs on a ring, of negative correlation for dark ones, at pixels of an\n"
        "image. disc, both: share of each pixel of a square of odd side inside the disc, and inside disc and ring.",
        discs_at, "image (H, W)", "disc (S=1..255, S)", "both (S, S)", "column (N)", "row (N)");
    def(module, "find_discs -> (N, 5)",
        "The same of discs of one sign at peaks of a relief of the image, of at least a height and px from its border, without a higher "
        "one\n"
        "within reach, and of which contrast and correlation exceed these; of more peaks than most the highest.",
        discs_of, "image (H, W)", "relief (H, W)", "disc (S=1..255, S)", "both (S, S)", "sign [-1, 1]", "margin [1, 1e3]", "reach [1, 1e3]",
        "height", "contrast", "correlation", "most [1, 1e9]");
    def(
        module, "centroids -> (N, 3)",
        "Position, px, and area, px^2, of dots near positions, of these diameters, px: centroids of what is brighter than the ground "
        "around\n"
        "them, darker for sign -1.",
        [](const Bytes& image, int sign, const Doubles& uv, const Doubles& diameter) {
            return each(centroids(as_image(image), sign, uv, diameter, uv.length()), &Centroid::u, &Centroid::v, &Centroid::area);
        },
        "image (H=2..1000000, W=2..1000000)", "sign [-1, 1]", "uv (N, 2) [-1e12, 1e12]", "diameter (N) [1e-6, 1e6]");
    using M = PrintModel;
    record(module, "PrintModel", "What is assumed of a print, and of the blobs of any image: docs/constants.md.",
           field("own_share", &M::own_share), field("sigma", &M::sigma), field("range", &M::range), field("odd_share", &M::odd_share),
           field("odd_sigmas", &M::odd_sigmas), field("in_line", &M::in_line), field("chance", &M::chance),
           field("max_regular", &M::max_regular), field("min_dots", &M::min_dots));
    using K = KnownDots;
    auto known = class_of<K, std::shared_ptr<K>>(
        module, "KnownDots", "Dots of the image in which their appearance was measured.",
        get("count", [](const K& one) { return one.uv.rows(); }),
        get("regular", &K::regular, "share of a dot's neighbours that make an equally spaced line with it and a third dot"));
    def(
        known, "compare -> (N), (N)",
        "Decimal log odds of discs by what contrasts and diameters differ from those near; and diameters near, px.",
        [](const K& one, const Rows2& uv, const Eigen::MatrixXd& logarithms) { return members<2>(one.compare(uv, logarithms)); },
        "uv (N, 2) [-1e12, 1e12]", "logarithms (N, 2)");
    def(
        module, "likely_dots -> (N) bool, log_odds, known",
        "Which discs are likelier to be dots of a print than blobs of any image; the decimal log odds of all; and the dots, None for too\n"
        "few. logarithms: of contrasts and diameters; own: decimal log odds of each alone; known: with which they are compared, None: "
        "with\n"
        "one another.",
        [](const Rows2& uv, const Eigen::MatrixXd& logarithms, const Eigen::VectorXd& own, const K* known, const M& model) {
            LikelyDots found = likely_dots(uv, logarithms, own, known, model);
            return std::tuple(std::move(found.kept), found.log_odds, std::move(found.known));
        },
        "uv (N, 2) [-1e12, 1e12]", "logarithms (N, K)", "own (N)", "known", py::arg_v("model", M(), "PrintModel()"));
    def(
        module, "without_doubles -> (N) bool", "Which positions have none of a higher score nearer than the larger distance apart of both.",
        [](const Doubles& uv, const Doubles& score, const Doubles& apart) { return without_doubles(uv, score, apart, uv.length()); },
        "uv (N, 2) [-1e12, 1e12]", "score (N)", "apart (N)");
    def(
        module, "find_lattice",
        "Lattice of dots at finite positions, px; of the four possible directions of its rows the one within 45 degrees of u.",
        [](const Doubles& positions) { return find_lattice(positions, positions.length()); }, "positions (N, 2) [-1e12, 1e12]");
    def(
        module, "deviation",
        "Whether dots at uv that are displaced by duv, NaN: unknown, are touched, and their largest deviation from a common affine\n"
        "motion, px; sigma: standard deviation of a coordinate, NaN: unknown.",
        [](const Rows2& uv, const Rows2& duv, const Eigen::VectorXd& sigma) { return members<2>(deviation(uv, duv, sigma)); },
        "uv (N, 2) [-1e12, 1e12]", "duv (N, 2)", "sigma (N)");
    using T = TrackLinks;
    class_of<T>(module, "TrackLinks", "Links from tracks to the dots of a frame.", get("dot (M)", &T::dot, "of each track, -1 for none"),
                get("position (M, 2)", &T::position, "px, of tracks without a link as their neighbours move"),
                get("spacing", &T::spacing, "px, typical distance of neighbours"),
                get("ambiguous", &T::ambiguous, "tracks without a link that a dot without one may continue"));
    def(
        module, "continuous -> (N) bool", "Which dots move from first to now, px, as the median of their neighbours does.",
        [](const Rows2& first, const Rows2& now) { return continuous(first.transpose(), now.transpose()); }, "first (N, 2) [-1e12, 1e12]",
        "now (N, 2) [-1e12, 1e12]");
    def(module, "link_tracks",
        "Links tracks with dots, px; seen: by the last frame; size: px of the image. A link that another probable motion of the pattern\n"
        "contradicts is none.",
        links, "last (M=2..1000000, 2) [-1e12, 1e12]", "predicted (M, 2) [-1e12, 1e12]", "first (M, 2) [-1e12, 1e12]", "seen (M)",
        "dots (N=1..1000000, 2) [-1e12, 1e12]", "size");
}

static const Subject SUBJECT("dots", bind_dots);

}  // namespace tactile::border
