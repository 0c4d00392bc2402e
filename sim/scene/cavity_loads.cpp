// Loads in the cavities of bodies.
#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "meshing/surface/counted.hpp"
#include "meshing/surface/shells.hpp"
#include "sim/scene/build_world.hpp"

namespace nbd {

std::vector<int> faces_at(const SceneLoad& load, NodesRef x, const Faces& F) {
    const std::vector<Shell> cavities = cavities_of(x, F);
    if (load.cavity && *load.cavity >= std::ssize(cavities))
        throw std::invalid_argument(fmt::format(
            "{}.cavity: is {}, but {}", load.key, *load.cavity,
            cavities.empty()
                ? "the body has no cavity: no part of its surface lies closed within another"
                : fmt::format("the body has {}, allowed: 0 to {}",
                              counted(std::ssize(cavities), "cavity", "cavities"), cavities.size() - 1)));
    if (load.cavity) return cavities[*load.cavity].faces;
    if (cavities.empty()) return {};
    std::vector<char> is_inside(F.rows(), 0);
    for (const Shell& cavity : cavities)
        for (const int f : cavity.faces) is_inside[f] = 1;
    std::vector<int> outside;
    for (int f = 0; f < F.rows(); ++f)
        if (is_inside[f] == 0) outside.push_back(f);
    return outside;
}

void check_gas_load(const SceneBody& spec, const WorldBody& body, std::size_t k) {
    if (spec.loads[k].load.kind != LoadKind::gas) return;
    if (body.elastic->is_rigid())
        throw std::invalid_argument(fmt::format(
            "{}.gas: a rigid body's cavities keep their volumes, so it does nothing", spec.loads[k].key));
    for (std::size_t other = 0; other < k; ++other)
        if (spec.loads[other].load.kind == LoadKind::gas && spec.loads[other].cavity == spec.loads[k].cavity)
            throw std::invalid_argument(fmt::format("{}.cavity: the gas of {} is in cavity {} already",
                                                    spec.loads[k].key, spec.loads[other].key,
                                                    *spec.loads[k].cavity));
}

}  // namespace nbd
