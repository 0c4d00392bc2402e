// inputs FOLDER: writes two trees, poses of both, and the pairs that `touching` must find, by comparing every
// face with every other.

#include <cstdio>
#include <filesystem>
#include <fstream>

#include "collision/flat/flat_tree.hpp"
#include "tests/support/brute_force.hpp"
#include "tests/support/shapes.hpp"

namespace nbd {
namespace {

void write(std::ofstream& out, const Vertices& x) {
    out.write(reinterpret_cast<const char*>(x.data()),
              static_cast<std::streamsize>(x.size() * sizeof(float)));
}

int make_inputs(const std::filesystem::path& folder) {
    const shapes::Surface torus = shapes::torus(24, 12), bar = shapes::bar(16, 9);
    save_flat_tree(folder / "torus.nbd", make_exact_tree(torus.X, torus.F));
    save_flat_tree(folder / "bar.nbd", make_exact_tree(bar.X, bar.F, {.depth = 4}));

    std::ofstream torus_poses(folder / "torus.f32", std::ios::binary),
        bar_poses(folder / "bar.f32", std::ios::binary), expected(folder / "expected.csv");
    expected << "frame,face_a,face_b\n";
    std::mt19937 random(4);
    int pairs = 0;
    for (int frame = 0; frame < 6; ++frame) {
        const auto place = [&](const Vertices& X) -> Vertices {
            return shapes::moved(shapes::wobbled(X, random, 0.05f), shapes::random_motion(random, 0.4f));
        };
        const Vertices x = place(torus.X), y = place(bar.X);
        write(torus_poses, x);
        write(bar_poses, y);
        for (const FacePair pair : test::brute_force_intersecting(x, torus.F, y, bar.F)) {
            expected << frame << ',' << pair.a << ',' << pair.b << '\n';
            ++pairs;
        }
    }
    std::printf("%d face pairs cross\n", pairs);
    return pairs > 100 ? 0 : 1;
}

}  // namespace
}  // namespace nbd

int main(int, char** argv) { return nbd::make_inputs(argv[1]); }
