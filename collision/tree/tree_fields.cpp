#include "collision/tree/tree_fields.hpp"

#include <utility>

namespace nbd {

StoredModels stored_models(const CollisionTree& tree) {
    StoredModels models;
    if (tree.learned_affine) models.learned_affine = tree.learned_affine->fit();
    if (tree.affine) models.affine = {tree.affine->rest(), tree.affine->weights()};
    return models;
}

void make_models(CollisionTree& tree, StoredModels models) {
    auto calibrations = std::exchange(tree.calibrations, {});  // of models that are still to be made, too
    check_collision_tree(tree);
    tree.boxes = make_boxes(tree);
    if (models.affine) hang_on_nodes(tree, models.affine->W, models.affine->rest);
    if (models.learned_affine)
        tree.learned_affine =
            std::make_shared<const LearnedAffineModel>(tree.boxes->tree(), *std::move(models.learned_affine));
    tree.calibrations = std::move(calibrations);
    check_collision_tree(tree);
}

}  // namespace nbd
