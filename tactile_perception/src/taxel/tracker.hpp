// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Tangential motion of the object from images of its pressure, and where it slips over the pad.
//
// Images are registered relative to the mean pressure of a keyframe, grown with the load. Pressure rises where traction converges, so the
// image leads an object that sticks: its motion is a known part of the image's. The pad's surface follows it up to friction times pressure
// (SurfaceShear); where it lags behind, the object slips. An object that rolls moves without the pressure of traction (RollWatch).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <deque>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "common/fields.hpp"
#include "taxel/motion.hpp"
#include "taxel/roll.hpp"
#include "taxel/shear.hpp"

namespace tactile::taxel {

// What decides, each with its unit and what it is: docs/taxel_array.md, docs/constants.md.
struct MotionLimits {
    // Registration
    double edge = 0.08;      // 1/taxel, limit: slope of an image, from which a taxel is of an edge: above the roughness of gains and faces
    double key_moved = 0.4;  // taxels, limit: motion since a keyframe, or the picture before a motion: slopes hold for parts of a taxel
    // Load
    double load_s = 0.06, load_change = 0.2;  // s and 1, prior: a change over this time to which the image's is attributed
    // Motion
    double bound = 2.5;   // sigmas, noise: by which velocities of ever longer stretches may differ (98 %)
    double begins = 4;    // sigmas of its velocity, noise: from which an object moves
    double creep = 0.16;  // taxels/s, physical: up to which the picture creeps by itself, as pad and sensing layer relax
    // Slip
    double lag = 0.05;  // 1, physical: of the object's motion, by which the surface lags where it slips: coupled neighbours creep a little
    // Rolling
    double traction = 0.04;  // 1/taxel, noise: traction over pressure that a picture that changes while it moves seems to show
    double curved = 0.03;    // 1, noise: of the variance of pressure over that of the area, along a motion
    TACTILE_FIELDS(edge, key_moved, load_s, load_change, bound, begins, creep, lag, traction, curved)
};

// Motion of the object in one frame, at the sensor's origin; NaN where unknown.
struct ObjectMotion {
    Eigen::Vector2d linear;              // m/s
    double turn;                         // rad/s
    std::vector<std::uint8_t> slipping;  // (rows, columns), where the object slips over the pad
    Eigen::Vector2d step;                // m, since the last frame
    double step_turn;                    // rad
    double unseen;                       // probability that an object that slips is not seen to
    std::ptrdiff_t columns;
    // Of step and step_turn, and of linear and turn. The picture's motion that is attributed to traction or to a change of load may be the
    // object's: the standard deviation along it is all of it, besides the noise of the registration.
    Eigen::Matrix3d step_covariance, velocity_covariance;
    TACTILE_FIELDS(linear, turn, slipping, step, step_turn, unseen, step_covariance, velocity_covariance)
};

// An image of the pressure on the pad (rows, columns), and what touches.
struct PressedPad {
    const float* pressure;        // Pa, without the part that traction causes
    const std::uint8_t* touched;  // at least one
    const float* seen;            // with that part
    double sigma;                 // noise of seen
};

// Tracks all contacts of an array as one rigid object.
class MotionTracker {
 public:
    MotionTracker(const ShearPad& pad, const MotionLimits& limits);
    // Nothing touches.
    void reset();
    // Motion and slip in one frame at a stamp, s; can_roll: whether the object can roll over the pad.
    ObjectMotion process(const PressedPad& frame, double stamp, bool can_roll);

    SurfaceShear shear;
    TACTILE_FIELDS(shear, lead)
    std::vector<float> traction_pressure;            // (rows, columns) Pa, that the traction causes under the pad
    Eigen::Vector2d lead = Eigen::Vector2d::Zero();  // m, by which that moves the border of the picture

 private:
    struct Now {  // the frame as keyframes take it
        Picture picture;
        const std::uint8_t* touched;
        std::ptrdiff_t count;  // of taxels in contact
        double load, sigma;
        bool few;  // of them: followed by the centroid
    };
    std::optional<KeyframeMotion> found_since_key(const Now& now) const;
    ObjectMotion unknown();
    double unseen(const KeyframeMotion& found) const;
    bool load_varies(double load, double stamp);
    bool moved(const KeyframeMotion& found, const Now& now) const;
    double released(double interval) const;
    std::pair<double, double> first_and_change(double interval) const;
    Eigen::Vector3d since_pose(const KeyframeMotion& found) const;
    Eigen::Vector3d at_origin(const Eigen::Vector3d& by_centre) const;
    Eigen::Vector3d step_of(const KeyframeMotion& found, double mean);
    void state_errors(const KeyframeMotion& found, const Eigen::Vector3d& by_centre, const PathMotion& path, ObjectMotion& motion) const;
    std::pair<Eigen::Vector3d, PathMotion> follow(const Eigen::Vector3d& step, const Eigen::Vector3d& rest, double stamp);
    bool is_evident(const PathMotion& path) const;
    Eigen::Vector3d along_of(const Eigen::Vector3d& velocity) const;
    std::vector<std::uint8_t> lagging(const std::vector<float>& slip, const Eigen::Vector3d& step, const std::uint8_t* touched) const;
    void rekey(const Now& now);
    double scale(double load) const;
    double taxel_x(std::ptrdiff_t column) const { return shear.pad().pitch * (static_cast<double>(column) - middle_[0]); }
    double taxel_y(std::ptrdiff_t row) const { return shear.pad().pitch * (static_cast<double>(row) - middle_[1]); }

    MotionLimits limits_;
    RollWatch watch_;
    Path path_;
    Eigen::Vector2d middle_;  // of the array: column and row
    double blur_;             // taxels, of the image's Gaussian
    std::ptrdiff_t few_;      // taxels, up to which a contact is followed by its pressure's centroid, for want of edges
    std::optional<EdgeKeyframe> edges_;
    std::optional<CentroidKeyframe> centroid_;
    double reach_ = 1;                             // taxels, of the keyframe
    std::optional<KeyframeMotion> last_;           // in the last frame
    Eigen::Vector4d expected_;                     // predicted fit of the next frame
    Eigen::Vector3d pose_, total_, smooth_;        // m, m, rad: of the key's centre since it; of the object since it touched; without noise
    std::deque<std::pair<double, double>> loads_;  // stamps and loads of the last frames
    double slip_fraction_;
    bool waited_;               // since the last frames, for a load that varies
    std::ptrdiff_t key_count_;  // taxels in the keyframe
    double followed_;           // object's part of the picture's motion
    bool moves_;
    Eigen::Vector2d arm_;    // m, of the keyframe's centre from the origin
    Eigen::Vector3d along_;  // unit vector of the motion of that centre, rotation as the path of the edges
};

}  // namespace tactile::taxel
