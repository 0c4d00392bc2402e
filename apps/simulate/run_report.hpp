#pragma once

#include <span>
#include <string>
#include <vector>

#include "apps/cli/output.hpp"
#include "apps/simulate/step_table.hpp"
#include "sim/scene/scene.hpp"

namespace nbd {

/// Tells how bodies were moved before the first step, and warns of what overlaps or touches at the start and
/// of bodies whose motion may be wrong. With --strict, throws std::runtime_error with the first warning of
/// the command, also one that came before. scene: name of its file.
void tell_start(const std::string& scene, const SceneSpec& spec, std::span<const LoadedBody> bodies,
                World& world, const std::vector<StartMove>& moves, const Output& out);

/// Warns of steps that went wrong. reason: of the first of this run that is not about inverted tetrahedra;
/// empty if an earlier part of the run had it.
void tell_trouble(const StepTotals& total, const std::string& reason, const Output& out);

/// Prints the results. size: length that distances are compared with, metres. output_us: mean time of the
/// outputs per frame, microseconds.
void tell_results(const SceneOutput& paths, bool is_static, int frames, const StepTotals& total, double size,
                  double output_us, const Output& out);

}  // namespace nbd
