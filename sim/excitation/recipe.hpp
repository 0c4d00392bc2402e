#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "meshing/body/body.hpp"
#include "meshing/surface/mesh.hpp"
#include "sim/excitation/recipe_ranges.hpp"
#include "sim/obstacles/obstacle.hpp"
#include "sim/world/grip.hpp"

namespace nbd {

/// Settings of training trajectories.
struct ExcitationConfig {
    int frames = 50;            // frames per trajectory, > 0
    double frame_interval = 0;  // seconds; 0: a fifth of the time that sound needs to cross the body
    int steps_per_frame = 2;    // > 0
    bool own_surface =
        false;  // whether a surface much finer than the tetrahedra makes contact, see Excitation
    RecipeRanges ranges{};
    std::uint64_t seed = 1;
};

/// Local thickness of a body: 4 V / A within a ball. It equals the diameter of a rod and twice the thickness
/// of a plate.
class LocalThickness {
 public:
    explicit LocalThickness(const TetMesh& tets);

    /// Thickness around a point, metres; infinite if no surface is near. radius: metres, > 0.
    double at(const Eigen::Vector3d& point, double radius) const;

    /// Volume, m3, of the tetrahedra with centroids in the ball.
    double volume(const Eigen::Vector3d& point, double radius) const;

 private:
    struct Piece {
        Eigen::Vector3d centroid;
        double measure;  // volume or area
    };
    static double sum(const std::vector<Piece>& pieces, const Eigen::Vector3d& point, double radius);

    std::vector<Piece> tets_, faces_;
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

/// Thickness above which a body counts as stocky, relative to its length.
constexpr double stocky = 0.095;

/// A force on the nodes around a node, strongest there and zero at `radius` (metres, in the rest pose). It
/// rises and falls over its duration.
struct PatchForce {
    int node = 0;
    double radius = 0;
    Eigen::Vector3d force = Eigen::Vector3d::Zero();  // newtons, total at the peak
    double start = 0, duration = 0;                   // seconds
};

/// Nodes that are held from the start, moved as told, and released.
struct Hand {
    std::vector<int> nodes{};
    Move move{};
    double release = 0;  // seconds

    Grip grip() const { return {.nodes = nodes, .motion = eased(move), .release = release}; }
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
    std::vector<Hand> grips;
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

/// The rigid obstacles of a recipe: its floor, and plates that move. The thrown copy is not one of them.
std::vector<Obstacle> recipe_obstacles(const Recipe& recipe);

/// Likewise from the text that recipe_json() makes and a trajectory keeps; none from a text that is not a
/// recipe's. Throws std::invalid_argument, one line, if its floor or plates cannot be used.
std::vector<Obstacle> recipe_obstacles(std::string_view json);

/// Throws std::invalid_argument naming the first number out of range.
void check_excitation_config(const ExcitationConfig& config);

/// Longest trajectory, in natural times of its body (NaturalScales::time): a million frames at the default
/// interval, and 50,000 times more for the warm-up. The number of forces grows with the duration, and each
/// takes memory and time before the first step.
constexpr int max_duration = 250'000;

/// Throws std::invalid_argument for trajectories that last longer than that.
void check_duration(const ExcitationConfig& config, const NaturalScales& scales);

}  // namespace nbd
