// 01: Which faces of two surfaces touch?
//
//     build/release/apps/examples/01_touching_faces
//
// One call over plain arrays: vertices [n, 3] and faces [m, 3]. The answer is exact. It suits a question that
// is asked once; example 02 shows what to do with surfaces that move.

#include <cstdio>
#include <exception>
#include <vector>

#include "apps/examples/ball.hpp"
#include "collision/query/one_shot.hpp"

int main() try {
    // Two balls of 1 m whose centres are 1.9 m apart: they overlap in a thin lens.
    const Surface a = ball(1);
    Surface b = a;
    b.x.col(0).array() += 1.9f;

    // Row p.a of a's faces and row p.b of b's have at least one point in common.
    const std::vector<nbd::FacePair> pairs = nbd::intersecting_faces(a.x, a.F, b.x, b.F);
    std::printf("%zu face pairs touch", pairs.size());
    if (!pairs.empty()) std::printf(", the first are faces %d and %d", pairs[0].a, pairs[0].b);
    std::puts("");

    // The same question with a distance: all pairs at most 5 cm apart, those that touch included.
    const auto near = nbd::face_pairs_within(a.x, a.F, b.x, b.F, 0.05f);
    std::printf("%zu face pairs are within 5 cm\n", near.size());

    // The bodies are too far apart: the answer is empty.
    b.x.col(0).array() += 1;
    const auto apart = nbd::intersecting_faces(a.x, a.F, b.x, b.F);
    std::printf("%zu face pairs touch after b has moved by 1 m\n", apart.size());

    return !pairs.empty() && near.size() > pairs.size() && apart.empty() ? 0 : 1;
} catch (const std::exception& error) {
    // Bad input, such as a face with an unknown vertex or a NaN, ends up here with a message of one line.
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
}
