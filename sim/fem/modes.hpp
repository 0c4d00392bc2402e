#pragma once

#include <cstdint>

#include "meshing/body/body.hpp"
#include "sim/fem/elastic_body.hpp"

namespace nbd {

struct ModeOptions {
    int count = 128;         // number of elastic modes, >= 1; the six rigid modes are not counted
    std::uint64_t seed = 1;  // seed of the starting vector
};

/// Accuracy and cost of the modes.
struct ModeReport {
    double max_rigid_hz = 0;    // largest |frequency| of the six rigid modes
    double gap = 0;             // smallest elastic eigenvalue over the largest absolute rigid one
    double rigid_residual = 0;  // largest part of a unit translation or rotation outside the six rigid modes
    double max_residual = 0;    // largest |K u - lambda M u| / |lambda M u| of the elastic modes
    double orthonormality = 0;  // largest entry of |U^T M U - I|
    int solves = 0;             // number of solves with the factorised K - sigma M
};

struct Modes {
    ModeBasis basis;
    ModeReport report;
};

/// How many modes a body of so many nodes can have.
int most_modes(int nodes) noexcept;

/// The lowest vibration modes K u = lambda M u of the free body at rest: frequencies in Hz, ascending;
/// columns M-orthonormal, the largest entry of each positive. The six rigid modes are computed too, checked
/// (exactly six that span translations and rotations) and dropped. The same seed gives the same bits. Uses
/// ARPACK in shift-invert mode with a shift just below zero. Throws std::invalid_argument for a count that
/// the body cannot have, std::runtime_error if the iteration does not converge or there are not exactly six
/// rigid modes (a body in several pieces, or hinged).
Modes vibration_modes(const ElasticBody& body, const ModeOptions& options = {});

}  // namespace nbd
