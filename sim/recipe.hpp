#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "meshing/body.hpp"
#include "sim/grip.hpp"

namespace nbd {

/// What makes training poses.
struct ExcitationConfig {
    int frames = 50;            // a trajectory, > 0
    double frame_interval = 0;  // seconds; 0: a fifth of the time in which sound crosses the body
    int steps_per_frame = 2;    // > 0
    double strength = 1;        // > 0; 1 gives local strains of 20 to 50 %
    std::uint64_t seed = 1;
};

/// Length, speed and time in which a body's motion is naturally measured, so that recipes suit any size,
/// stiffness and density.
struct NaturalScales {
    double length = 1;  // diagonal of the rest pose's box, metres
    double speed = 1;   // sqrt(young / density), m/s
    double time = 1;    // length / speed, seconds
};
NaturalScales natural_scales(const Body& body);

/// A force on the nodes around one, strongest there and zero at `radius` (metres, in the rest pose), that
/// swells and fades over its duration.
struct PatchForce {
    int node = 0;
    double radius = 0;
    Eigen::Vector3d force = Eigen::Vector3d::Zero();  // newtons, in all, at its peak
    double start = 0, duration = 0;                   // seconds
};

/// A second copy of the body.
struct ThrownCopy {
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
};

enum class RecipeKind { drop, forces, grips, thrown, free };

/// All that happens in one training trajectory. World frame, SI units. The body starts with its centroid at
/// the origin, turned by `rotation`, at velocity + gradient x.
struct Recipe {
    RecipeKind kind = RecipeKind::free;
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
    Eigen::Matrix3d gradient = Eigen::Matrix3d::Zero();  // 1/s
    Eigen::Vector3d gravity = Eigen::Vector3d::Zero();
    std::optional<double> floor;  // height
    std::vector<PatchForce> forces;
    std::vector<Grip> grips;
    std::optional<ThrownCopy> thrown;
    double frame_interval = 0;  // seconds
    double first_frame = 0;     // seconds: motion begins before it
};

/// Recipe of trajectory `index`, a pure function of its arguments. Kinds take turns with the index; what else
/// happens, and all numbers, are drawn.
Recipe draw_recipe(const Body& body, const ExcitationConfig& config, int index);

/// As JSON text, for the record.
std::string recipe_json(const Recipe& recipe);

/// Throws std::invalid_argument naming the first number that is out of range.
void check_excitation_config(const ExcitationConfig& config);

}  // namespace nbd
