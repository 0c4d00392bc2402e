#pragma once

#include "training/files/tree_file.hpp"

namespace nbd {

/// Transfers a trained tree to another resolution of its surface. Each face goes to the leaf whose part of
/// the trained surface is nearest to the face's centre at rest; each representative becomes the nearest
/// vertex. `nbd` bounds are transferred with their calibration, because they read positions alone. If the
/// finer surface is the trained one with faces subdivided in their planes, spheres and margins contain the
/// same points as before, since new vertices lie between old ones. Bodies with tetrahedra also get affine
/// bounds, which are not transferred but made.
/// body: has the other surface; its rest positions must lie over the trained ones. Throws
/// std::invalid_argument if the tree has no such bounds, if the surfaces do not lie over each other (a
/// representative moves by more than a tenth of the body's radius), or if a leaf gets no face.
TreeFile transfer_tree(const TreeFile& trained, const SurfaceBody& body);

}  // namespace nbd
