#pragma once

#include <span>

#include "collision/geometry/embedding.hpp"

namespace nbd {

/// Throws std::invalid_argument unless these arrays are the compressed rows of an embedding: vertex v has the
/// entries k in [row_begin[v], row_begin[v + 1]), each with a column in [0, node_count) and a weight.
void check_embedding_rows(std::span<const int> row_begin, std::span<const int> columns,
                          std::span<const float> weights, int node_count);

/// The embedding with these rows. Throws likewise, and if the columns of a row do not ascend.
SurfaceEmbedding embedding_of_rows(std::span<const int> row_begin, std::span<const int> columns,
                                   std::span<const float> weights, int node_count);

}  // namespace nbd
