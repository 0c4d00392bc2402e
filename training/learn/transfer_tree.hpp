#pragma once

#include "training/files/tree_file.hpp"

namespace nbd {

/// Carries a trained tree over to another resolution of the surface that it was trained on: each face goes to
/// the leaf whose part of the trained surface is nearest to its middle at rest, each sample and
/// representative becomes the vertex nearest to it. Of the models, `local` and `modal` go along with their
/// calibration, since they read nothing but positions; no node counts as exact any more. Where the finer
/// surface is the trained one with faces cut in flat pieces, spheres and margins hold exactly what they held
/// before: new vertices lie between old ones. body: of the other surface; its rest positions must lie over
/// the trained ones. Throws std::invalid_argument where the tree has neither, the surfaces do not lie over
/// each other (a sample moves by more than a tenth of its node's radius, a representative of the body's), or
/// a leaf gets no face.
TreeFile transfer_tree(const TreeFile& trained, const SurfaceBody& body);

}  // namespace nbd
