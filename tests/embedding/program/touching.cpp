// Prints which triangles of two deforming bodies touch in each frame.
//
//     touching TREE POSES TREE POSES [BOUNDS] > pairs.csv
//
// TREE: output of `nbdtree export --flat TREE.h5 -o TREE.nbd`. POSES: in place of a simulator, a file with
// the positions of all vertices, float32 x y z, frame after frame. BOUNDS: bounds that both trees have,
// `boxes` by default.

#include <cstdio>
#include <exception>
#include <fstream>
#include <memory>

#include "nbdtree/flat/flat_tree.hpp"
#include "nbdtree/query/pair_query.hpp"

namespace {

class Body {
 public:
    Body(const char* tree_file, const char* pose_file, nbd::BoundKind kind)
        : tree_(std::make_shared<const nbd::CollisionTree>(nbd::load_flat_tree(tree_file)), kind),
          x_(tree_.tree().vertex_count, 3),
          poses_(pose_file, std::ios::binary) {}

    bool next_frame() {
        const auto bytes =
            static_cast<std::streamsize>(x_.size()) * static_cast<std::streamsize>(sizeof(float));
        if (!poses_.read(reinterpret_cast<char*>(x_.data()), bytes)) return false;
        tree_.begin_pose(x_);  // keeps a reference; a query reads only the positions it needs
        return true;
    }
    nbd::PosedTree& tree() { return tree_; }

 private:
    nbd::PosedTree tree_;
    nbd::Vertices x_;  // [vertices, 3] metres, in the vertex order of the tree's surface
    std::ifstream poses_;
};

}  // namespace

int main(int argc, char** argv) try {
    if (argc != 5 && argc != 6) {
        std::fprintf(stderr, "usage: %s TREE POSES TREE POSES [BOUNDS]\n", argv[0]);
        return 2;
    }
    const nbd::BoundKind kind = nbd::bound_kind(argc == 6 ? argv[5] : "boxes");
    Body a(argv[1], argv[2], kind), b(argv[3], argv[4], kind);
    nbd::PairQuery query;  // keeps its scratch memory: after the first frames it allocates nothing
    std::puts("frame,face_a,face_b");
    for (int frame = 0; a.next_frame() && b.next_frame(); ++frame)
        for (const nbd::FacePair pair : query.intersecting(a.tree(), b.tree()))
            std::printf("%d,%d,%d\n", frame, pair.a, pair.b);
} catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
}
