#pragma once

#include <algorithm>
#include <array>

#include "collision/neighbours/face_pair_set.hpp"
#include "collision/neighbours/neighbour_proof.hpp"

namespace nbd {

/// Which pairs a walk over two bodies takes: all.
struct TwoBodies {
    static bool children(int, int, int, int) noexcept { return true; }
    static bool faces(int, int) noexcept { return true; }
    static unsigned proved_apart(int, int) noexcept { return 0; }
};

/// Which pairs a walk over one body with itself takes: every pair of parts once, and no faces that share a
/// vertex or are among those left out. Posed: the boxes of the body, AffineBoxes or LeafBoxes.
template <class Posed>
class OneBody {
 public:
    /// left_out, proof: null: none.
    OneBody(const Posed& body, const FacePairSet* left_out, const NeighbourProof* proof) noexcept
        : body_(body), left_out_(left_out), proof_(proof) {}

    /// Whether to take children i and j of nodes a and b.
    static bool children(int a, int b, int i, int j) noexcept { return a != b || i <= j; }
    /// Whether to take the faces in two slots. A face shares vertices with itself.
    bool faces(int slot_a, int slot_b) const noexcept {
        const std::array<int, 3> s = body_.face_vertices(slot_a), t = body_.face_vertices(slot_b);
        for (const int v : s)
            if (v == t[0] || v == t[1] || v == t[2]) return false;
        return !(left_out_ && left_out_->contains(body_.face(slot_a), body_.face(slot_b)));
    }
    /// Bits of faces of leaf b that are proved apart from all of leaf a.
    unsigned proved_apart(int leaf_a, int leaf_b) const noexcept {
        return proof_ ? proof_->apart(leaf_a, leaf_b) : 0;
    }

 private:
    const Posed& body_;
    const FacePairSet* left_out_;
    const NeighbourProof* proof_;
};

}  // namespace nbd
