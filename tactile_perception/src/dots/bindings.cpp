// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Dots for Python, as module _core.dots.
#include "bindings/bindings.hpp"

#include "bindings/border.hpp"
#include "common/rows.hpp"
#include "dots/blobs.hpp"
#include "dots/discs.hpp"
#include "dots/finder.hpp"
#include "dots/lattice.hpp"
#include "dots/likely.hpp"
#include "dots/links.hpp"
#include "dots/numbering.hpp"
#include "dots/reference.hpp"

namespace tactile::border {
namespace {

using Bytes = Array<std::uint8_t>;
using Doubles = Array<double>;

Image as_image(const Bytes& image) {
    return {image, image.length(0), image.length(1)};
}

// The tables of tactile_perception.dots.fit.DiscModel: a DiscModel's members of the same names.
std::shared_ptr<const DiscModel> as_model(const py::object& given) {
    static_assert(ESTIMATES == 5 && DIMENSIONS == 32 && MODES == 10 && LARGEST_HALF == 30);
    Lengths lengths;
    const Lines lines{"half [1, 30]",
                      "smallest [0.1, 100]",
                      "largest [0.1, 200]",
                      "blur [0, 100]",
                      "per_square [1e-3, 1e3]",
                      "estimators (S=2..1000000, P=2..1000000, P, 5, 32)",
                      "basis (B, 32)",
                      "modes (S, P, P, 10, 32)",
                      "gains (S, P, P)",
                      "levers (S, 2)",
                      "profile (N=2..1000000, L=2..1000000)"};
    auto model = from_attributes<DiscModel>(given, lines, lengths);
    check_rows("basis", lengths['B'], (model.half + 1) * (model.half + 1));
    within(model.largest, "largest", model.smallest + 1e-3, 200);
    model.diameters = lengths['S'], model.phases = lengths['P'], model.profiles = lengths['N'], model.profile_length = lengths['L'];
    return std::make_shared<DiscModel>(std::move(model));
}

// The numbers of tactile_perception.dots.appearance.Appearance.
DotLook as_look(const py::object& given) {
    const auto number = [&](const Rule& rule) {
        const auto value = given.attr(rule.name.c_str()).cast<double>();
        rule.check(&value, 1);
        return value;
    };
    return {number(Rule("typical [0.5, 100]")), number(Rule("contrast [-1e6, 1e6]")),
            static_cast<int>(std::nearbyint(number(Rule("ground [0, 255]")))), number(Rule("noise [0, 1e6]")),
            static_cast<int>(number(Rule("step [1, 1e3]")))};
}

// A member of each of several results; positions: of u and v.
template <class Result, class... Member>
std::vector<double> each(const std::vector<Result>& results, Member... members) {
    std::vector<double> found;
    for (const Result& one : results) (found.push_back(one.*members), ...);
    return found;
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

std::vector<double> discs_of(const Floats& image, const Floats& relief, const Floats& disc, const Floats& both, const DiscSearch& search) {
    within(disc.length() % 2, "disc", 1, 1);
    return rows_of(find_discs({image, image.length(0), image.length(1)}, relief, {disc, both, disc.length()}, search));
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
    def(module, "extract_channel -> (H, W)", "One channel of an image.", {"image (H, W, 3)", "channel [0, 2]"},
        [](const Bytes& image, int channel) { return extract_channel({image, image.length(0), image.length(1)}, channel); });
    class_of<FoundDots>(module, "FoundDots", "Dots of an image, px: src/dots/finder.hpp.", {"uv candidates (N, 2)", "area sigma (N)"});
    record<DotLimits>(module, "DotLimits", "What decides what is a dot: docs/constants.md.");
    auto finder = class_of<DotFinder>(module, "DotFinder",
                                      "Finds dots by a maximum-likelihood fit of each candidate, and rejects what is no dot. model:\n"
                                      "dots.fit.DiscModel; look: dots.appearance.Appearance.");
    init(
        finder, {"model", "look", "limits"},
        [](const py::object& model, const py::object& look, const DotLimits& limits) {
            return DotFinder(as_model(model), as_look(look), limits);
        },
        DotLimits());
    def(finder, "find", "Dots of an image, reduced as the look says, in px of the whole image.", {"image (H, W)"},
        [](const DotFinder& one, const Bytes& image) { return one.find(as_image(image)); });
    auto blobs = class_of<BlobFinder>(module, "BlobFinder", "Finds large markers of an image: src/dots/blobs.hpp.");
    init(blobs, {"sign [-1, 1]", "step [1, 2]", "box [1, 999]", "threshold [0, 255]", "area [1e-6, 1e12]"},
         [](int sign, int step, int box, double threshold, double area) {
             within(box % 2, "box", 1, 1);
             return BlobFinder({sign, step, box, threshold, area});
         });
    def(blobs, "find", "FoundDots of an image.", {"image (H=4..1000000, W=4..1000000)"},
        [](const BlobFinder& one, const Bytes& image) { return one.find(as_image(image)); });
    class_of<Lattice>(module, "Lattice", "Relative indices of dots on a printed grid: src/dots/lattice.hpp.",
                      {"rc (N, 2)", "member (N) bool"});
    def(module, "find_lattice", "Lattice of dots at positions, px, with the direction of its rows within 45 degrees of u.",
        {"positions (N, 2) [-1e12, 1e12]"}, [](const Doubles& positions) { return find_lattice(positions, positions.length()); });
    auto numbers = record<GridNumbers>(module, "GridNumbers", "Numbers of dots on a printed grid: src/dots/numbering.hpp.", {"id (N)"});
    get(numbers, "certain", "whether the frame is numbered; single dots may still have -1",
        [](const GridNumbers& one) { return one.reason.empty(); });
    auto numbering = class_of<GridNumbering>(module, "GridNumbering", "Rows and columns of dots on a printed grid, image by image.");
    init(
        numbering, {"rows", "columns", "is_whole"},
        [](std::int64_t rows, std::int64_t columns, bool is_whole) {
            if (std::min(rows, columns) < 2 || std::max(rows, columns) > MAX_ROWS)
                refuse("a grid has at least 2 rows and 2 columns, not " + std::to_string(rows) + " x " + std::to_string(columns) +
                       "; use rows = columns = 0 with the tracker for other patterns");
            return GridNumbering({rows, columns, is_whole});
        },
        true);
    def(
        numbering, "number", "Numbers of dots at uv, px. The published method needs the image's size; this one does not.",
        {"uv (N, 2)", "width", "height"},
        [](GridNumbering& one, const Rows2& uv, double, double) {
            return change(one, [&](GridNumbering& next) { return next.number(uv); });
        },
        0.0, 0.0);
    def(module, "find_grid", "Rows and columns of the grid that dots at uv, px, form, as far as it is seen; 0 where most form none.",
        {"uv (N, 2)"}, [](const Rows2& uv) {
            const PrintedGrid found = find_grid(uv);
            return std::pair(found.rows, found.columns);
        });
    using R = DotReference;
    class_of<R::Update>(module, "ReferenceUpdate", "Displacements of dots, px: src/dots/reference.hpp.");
    auto reference = class_of<R>(module, "DotReference", "Undeformed positions of dots: src/dots/reference.hpp.");
    init(reference, {"time_constant_s [1e-300, inf]", "frames [1, 1e9]"},
         [](double time_constant_s, std::int64_t frames) { return R(time_constant_s, frames); });
    get(reference, "count", "of dots", [](const R& one) { return one.positions().id.size(); });
    get(reference, "id (K)", "rising", [](const R& one) { return one.positions().id; });
    get(reference, "uv (K, 2)", "px", [](const R& one) { return one.positions().uv; });
    get(reference, "is_touched", "whether something touched in the last frame", &R::is_touched);
    def(reference, "reset", "Forget all positions.", {}, &R::reset);
    def(reference, "take", "Replace the positions by uv, px, each of which counts as so many averaged frames.",
        {"id (N)", "uv (N, 2) [-1e12, 1e12]", "frames (N)"}, &R::take);
    def(reference, "displacement", "uv less the positions of these dots, px; NaN where unknown.", {"id (N)", "uv (N, 2)"},
        &R::displacement);
    def(reference, "update",
        "Displacements of dots, and whether dots were added; is_touched: as known by a later stage, None to decide by the dots.",
        {"id (N)", "uv (N, 2)", "sigma (N)", "stamp_s", "is_touched"},
        [](R& one, const Numbers& id, const Rows2& uv, const Eigen::VectorXd& sigma, double stamp_s, std::optional<bool> is_touched) {
            return one.update({id, uv, sigma}, stamp_s, is_touched);
        });
    class_of<TrackLinks>(module, "TrackLinks", "Links from tracks to the dots of a frame: src/dots/links.hpp.", {"position (M, 2)"});
    def(module, "discs_at -> (N, 5)", "Column, row, correlation, amplitude and ground of discs on a ring at pixels: src/dots/discs.hpp.",
        {"image (H, W)", "disc (S=1..255, S)", "both (S, S)", "column (N)", "row (N)"}, discs_at);
    record<DiscSearch>(module, "DiscSearch", "What decides which peaks are discs: src/dots/discs.hpp.",
                       {"sign [-1, 1]", "margin reach [1, 1e3]", "most [1, 1e9]"});
    def(module, "find_discs -> (N, 5)", "The same of discs at the peaks of a relief of the image.",
        {"image (H, W)", "relief (H, W)", "disc (S=1..255, S)", "both (S, S)", "search"}, discs_of);
    def(module, "centroids -> (N, 3)", "Position, px, and area, px^2, of dots of a sign near positions, of these diameters, px.",
        {"image (H=2..1000000, W=2..1000000)", "sign [-1, 1]", "uv (N, 2) [-1e12, 1e12]", "diameter (N) [1e-6, 1e6]"},
        [](const Bytes& image, int sign, const Doubles& uv, const Doubles& diameter) {
            return each(centroids(as_image(image), sign, uv, diameter, uv.length()), &Centroid::u, &Centroid::v, &Centroid::area);
        });
    record<PrintModel>(module, "PrintModel", "What is assumed of a print, and of the blobs of any image: docs/constants.md.");
    using K = KnownDots;
    auto known = class_of<K, std::shared_ptr<K>>(module, "KnownDots", "Dots of the image in which their appearance was measured.");
    get(known, "count", "", [](const K& one) { return one.uv.rows(); });
    get(known, "regular", "share of a dot's neighbours that make an equally spaced line with it and a third dot", &K::regular);
    def(known, "compare -> (N), (N)",
        "Decimal log odds of discs by what contrasts and diameters differ from those near; and diameters near, px.",
        {"uv (N, 2) [-1e12, 1e12]", "logarithms (N, 2)"}, [](const K& one, const Rows2& uv, const Eigen::MatrixXd& logarithms) {
            K::Comparison found = one.compare(uv, logarithms);
            return std::tuple(std::move(found.log_odds), std::move(found.diameter));
        });
    def(
        module, "likely_dots -> (N) bool, log_odds, known",
        "Which discs are likelier to be dots of a print than blobs of any image; the decimal log odds of all; and the dots, None for too\n"
        "few: src/dots/likely.hpp.",
        {"uv (N, 2) [-1e12, 1e12]", "logarithms (N, K)", "own (N)", "known", "model"},
        [](const Rows2& uv, const Eigen::MatrixXd& logarithms, const Eigen::VectorXd& own, const K* known, const PrintModel& model) {
            LikelyDots found = likely_dots(uv, logarithms, own, known, model);
            return std::tuple(std::move(found.kept), found.log_odds, std::move(found.known));
        },
        PrintModel());
    def(module, "without_doubles -> (N) bool", "Which positions have none of a higher score nearer than the larger distance apart of both.",
        {"uv (N, 2) [-1e12, 1e12]", "score (N)", "apart (N)"},
        [](const Doubles& uv, const Doubles& score, const Doubles& apart) { return without_doubles(uv, score, apart, uv.length()); });
    def(module, "continuous -> (N) bool", "Which dots move from first to now, px, as the median of their neighbours does.",
        {"first (N, 2) [-1e12, 1e12]", "now (N, 2) [-1e12, 1e12]"},
        [](const Rows2& first, const Rows2& now) { return continuous(first.transpose(), now.transpose()); });
    def(module, "link_tracks",
        "Links tracks with dots, px; seen: by the last frame; size: px of the image. A link that another probable motion of the pattern\n"
        "contradicts is none.",
        {"last (M=2..1000000, 2) [-1e12, 1e12]", "predicted (M, 2) [-1e12, 1e12]", "first (M, 2) [-1e12, 1e12]", "seen (M)",
         "dots (N=1..1000000, 2) [-1e12, 1e12]", "size"},
        links);
}

static const Subject SUBJECT("dots", bind_dots);

}  // namespace tactile::border
