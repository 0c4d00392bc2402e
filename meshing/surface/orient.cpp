#include "meshing/surface/orient.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace nbd {

Components make_orientations_agree(Faces& F, const EdgeTable& table) {
    const std::size_t face_count = F.rows();
    Components components{0, std::vector<int>(face_count, -1)};
    std::vector<char> turned(face_count, 0);
    const auto starts_low = [&](int h) { return F(h / 3, h % 3) < F(h / 3, (h % 3 + 1) % 3); };
    std::vector<int> stack;
    for (int seed = 0; seed < F.rows(); ++seed) {
        if (components.of_face[seed] >= 0) continue;
        components.of_face[seed] = components.count;
        stack.push_back(seed);
        while (!stack.empty()) {
            const int f = stack.back();
            stack.pop_back();
            for (int h = 3 * f; h < 3 * f + 3; ++h) {
                const int twin = table.twin(h), g = twin / 3;
                // Compares the faces as stored in F; F is changed only at the end.
                const bool agree = starts_low(h) != starts_low(twin);
                const char wanted = static_cast<char>(turned[f] != (agree ? 0 : 1));
                int& component = components.of_face[g];
                if (component < 0) {
                    component = components.count;
                    turned[g] = wanted;
                    stack.push_back(g);
                } else if (turned[g] != wanted) {
                    throw std::invalid_argument(fmt::format(
                        "the surface is one-sided (like a Klein bottle): faces {} and {} cannot be "
                        "oriented consistently",
                        std::min(f, g), std::max(f, g)));
                }
            }
        }
        ++components.count;
    }
    for (int f = 0; f < F.rows(); ++f)
        if (turned[f]) std::swap(F(f, 1), F(f, 2));
    return components;
}

}  // namespace nbd
