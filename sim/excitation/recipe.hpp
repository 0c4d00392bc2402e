#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "meshing/body/body.hpp"
#include "sim/excitation/recipe_ranges.hpp"
#include "sim/excitation/thickness.hpp"
#include "sim/solvers/linear_solve_config.hpp"
#include "sim/world/grip.hpp"

namespace nbd {

/// Settings of training trajectories.
struct ExcitationConfig {
    int frames = 50;                 // frames per trajectory, > 0
    double frame_interval = 0;       // seconds; 0: a fifth of the time that sound needs to cross the body
    int steps_per_frame = 2;         // > 0
    bool self_contact = false;       // the body meets itself, see ContactConfig
    bool intersection_free = false;  // steps keep all surfaces apart, see ContactConfig
    LinearSolveConfig linear{};
    RecipeRanges ranges{};
    std::uint64_t seed = 1;
};

/// Natural length, speed and time of a body's motion, so that recipes suit any size, stiffness and density.
struct NaturalScales {
    double length = 1;  // diagonal of the rest pose's box, metres
    double young = 1;   // mean over the body, Pa
    double speed = 1;   // sqrt(young / mean density), m/s
    double time = 1;    // length / speed, seconds
    /// Strength of excitation relative to a stocky body, in (0, 1], so that thin limbs neither fold nor tear.
    /// Proportional to the lower quartile of the body's thickness; 1 from about a tenth of the length on. A
    /// limb bends by an angle of about (speed / speed of sound) (length / thickness).
    double sturdiness = 1;
};
NaturalScales natural_scales(const Body& body, const LocalThickness& thickness);

/// A force on the nodes around a node, strongest there and zero at `radius` (metres, in the rest pose). It
/// rises and falls over its duration.
struct PatchForce {
    int node = 0;
    double radius = 0;
    Eigen::Vector3d force = Eigen::Vector3d::Zero();  // newtons, total at the peak
    double start = 0, duration = 0;                   // seconds
};

/// A plate that moves along its normal until it stands still.
struct Plate {
    Eigen::Vector3d point = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::UnitZ();
    double speed = 0, stop = 0;  // m/s, seconds
};

/// A second copy of the body.
struct ThrownCopy {
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
};

/// Everything that happens in one training trajectory. World frame, SI units. The body starts with its
/// centroid at the origin, rotated by `rotation`, with velocity + gradient x.
struct Recipe {
    RecipeKind kind = RecipeKind::free;
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
    Eigen::Matrix3d gradient = Eigen::Matrix3d::Zero();  // 1/s
    Eigen::Vector3d gravity = Eigen::Vector3d::Zero();
    std::optional<double> floor;  // height
    std::vector<PatchForce> forces;
    std::vector<Grip> grips;
    std::vector<Plate> plates;
    std::optional<ThrownCopy> thrown;
    double frame_interval = 0;  // seconds
    double first_frame = 0;     // seconds; motion starts before it
};

/// Draws the recipes of a body's trajectories.
class RecipeBook {
 public:
    /// Throws std::invalid_argument naming the first number out of range, or as check_duration().
    RecipeBook(std::shared_ptr<const Body> body, const ExcitationConfig& config);

    /// Recipe of trajectory `index`, >= 0: a pure function of body, config and index. Any run of trajectories
    /// has its kinds in the proportions of the mix; all numbers are drawn. Throws StopAsked as
    /// stop_if_asked().
    Recipe draw(int index) const;

    const NaturalScales& scales() const noexcept { return scales_; }
    double frame_interval() const noexcept;  // seconds

 private:
    std::shared_ptr<const Body> body_;
    ExcitationConfig config_;
    LocalThickness thickness_;
    NaturalScales scales_;
};

/// The recipe as JSON text, to be stored with the trajectory.
std::string recipe_json(const Recipe& recipe);

/// Throws std::invalid_argument naming the first number out of range.
void check_excitation_config(const ExcitationConfig& config);

/// Longest trajectory, in natural times of its body (NaturalScales::time): a million frames at the default
/// interval, and 50,000 times more for the warm-up. The number of forces grows with the duration, and each
/// takes memory and time before the first step.
constexpr int max_duration = 250'000;

/// Throws std::invalid_argument for trajectories that last longer than that.
void check_duration(const ExcitationConfig& config, const NaturalScales& scales);

}  // namespace nbd
