#include "meshing/surface/drop_unreferenced.hpp"

#include <vector>

namespace nbd {

int drop_unreferenced(TriMesh& mesh) {
    std::vector<int> number(mesh.X.rows(), -1);
    for (int f = 0; f < mesh.F.rows(); ++f)
        for (int c = 0; c < 3; ++c) number[mesh.F(f, c)] = 0;
    int kept = 0;
    for (int v = 0; v < mesh.X.rows(); ++v) {
        if (number[v] < 0) continue;
        number[v] = kept;
        mesh.X.row(kept++) = mesh.X.row(v).eval();
    }
    const int dropped = static_cast<int>(mesh.X.rows()) - kept;
    mesh.X.conservativeResize(kept, 3);
    for (int f = 0; f < mesh.F.rows(); ++f)
        for (int c = 0; c < 3; ++c) mesh.F(f, c) = number[mesh.F(f, c)];
    return dropped;
}

}  // namespace nbd
