#include "apps/bench/exactness/exactness.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <list>

#include "apps/bench/exactness/swept_pairs.hpp"
#include "apps/bench/measure/measure.hpp"
#include "collision/kernels/kernels.hpp"
#include "collision/query/pair_query.hpp"

namespace nbd {
namespace {

constexpr std::pair<BoundKind, BoundKind> mixes[] = {
    {BoundKind::affine, BoundKind::affine}, {BoundKind::boxes, BoundKind::boxes},
    {BoundKind::exact, BoundKind::exact},   {BoundKind::automatic, BoundKind::automatic},
    {BoundKind::affine, BoundKind::boxes},  {BoundKind::exact, BoundKind::affine},
};

/// The kernels of this machine in turn; those of before come back at the end.
class AllKernels {
 public:
    AllKernels() {
        for (const InstructionSet set : {InstructionSet::plain, InstructionSet::avx2, InstructionSet::avx512})
            if (const Kernels* form = kernels_for(set)) forms_.push_back(form);
    }
    ~AllKernels() { use_kernels(*before_); }
    AllKernels(const AllKernels&) = delete;
    AllKernels& operator=(const AllKernels&) = delete;
    const std::vector<const Kernels*>& forms() const { return forms_; }

 private:
    const Kernels* before_ = &kernels();
    std::vector<const Kernels*> forms_;
};

/// Two bodies with the given bounds.
struct Couple {
    BoundKind kind_a, kind_b;
    PosedTree a, b;

    Couple(const std::shared_ptr<const CollisionTree>& tree, BoundKind in_a, BoundKind in_b)
        : kind_a(in_a), kind_b(in_b), a(tree, in_a), b(tree, in_b) {}
};

struct Stage {
    WildScene nodes;
    Vertices a, b;
    float distance = 0;  // 0: intersecting faces
    std::vector<FacePair> truth;
};

/// Bodies have a half diagonal of about 1 there.
Stage draw_stage(const BenchBody& body, WildPose pose, const ExactnessConfig& config, int scene) {
    const SurfaceBody& surface = body.surface;
    CounterRandom random(config.seed, scene);
    Stage stage;
    if (scene % 4 == 3) stage.distance = static_cast<float>(std::pow(10, random.uniform(-4, -2.5)));
    for (double overlap = random.uniform(0.02, 0.2); overlap < 0.9 && stage.truth.empty(); overlap += 0.15) {
        stage.nodes = draw_wild_scene(surface.solid.X.cast<float>(), pose, overlap, random);
        apply_embedding(surface.W, stage.nodes.a, stage.a);
        apply_embedding(surface.W, stage.nodes.b, stage.b);
        stage.truth = swept_pairs(stage.a, surface.F, stage.b, surface.F, stage.distance);
    }
    return stage;
}

void begin_pose(PosedTree& tree, const Vertices& x, const Vertices& nodes) {
    if (tree.takes_nodes())
        tree.begin_pose_of_nodes(nodes);
    else
        tree.begin_pose(x);
}

}  // namespace

std::vector<ExactnessRow> check_exactness(const BenchBody& body, const ExactnessConfig& config,
                                          const std::function<void(int)>& done) {
    std::vector<ExactnessRow> rows;
    for (const WildPose pose : wild_poses) rows.push_back({.pose = pose, .faces = body.faces()});
    std::list<Couple> couples;
    for (const auto& [kind_a, kind_b] : mixes) couples.emplace_back(body.tree, kind_a, kind_b);
    const AllKernels all;
    PairQuery query;
    for (int scene = 0; scene < config.scenes; ++scene) {
        ExactnessRow& row = rows[scene % rows.size()];
        const Stage stage = draw_stage(body, row.pose, config, scene);
        ++row.scenes;
        row.touching += !stage.truth.empty();
        row.pairs += stage.truth.size();
        for (const Kernels* form : all.forms()) {
            use_kernels(*form);
            for (Couple& couple : couples) {
                begin_pose(couple.a, stage.a, stage.nodes.a);
                begin_pose(couple.b, stage.b, stage.nodes.b);
                const auto found = stage.distance > 0 ? query.within(couple.a, couple.b, stage.distance)
                                                      : query.intersecting(couple.a, couple.b);
                ++row.queries;
                if (std::ranges::equal(found, stage.truth)) continue;
                ++row.different;
                if (row.first_difference.empty())
                    row.first_difference =
                        fmt::format("{} against {}, {} kernels, scene {}", name(couple.kind_a),
                                    name(couple.kind_b), name(form->instructions), scene);
            }
        }
        done(scene + 1);
    }
    return rows;
}

std::string to_csv(std::span<const std::string> bodies, std::span<const std::vector<ExactnessRow>> rows) {
    std::string text = fmt::format(
        "# {}\nbody,faces,poses,scenes,touching,pairs,queries,different,first_difference\n", this_machine());
    for (std::size_t i = 0; i < bodies.size(); ++i)
        for (const ExactnessRow& r : rows[i])
            text += fmt::format("{},{},{},{},{},{},{},{},{}\n", bodies[i], r.faces, name(r.pose), r.scenes,
                                r.touching, r.pairs, r.queries, r.different, r.first_difference);
    return text;
}

}  // namespace nbd
