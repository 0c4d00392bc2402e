#pragma once

#include <CLI/CLI.hpp>

#include "sim/fem/elastic_body.hpp"
#include "training/files/recording.hpp"

namespace nbd {

/// What a recording shall hold besides positions.
struct ExtrasRequest {
    PerField<bool> fields{};
    bool contact_edges = false;
};

/// The options with which a command asks for extras.
void add_extras_options(CLI::App& command, ExtrasRequest& request);

/// Fills the fields that are asked for. x: [N, 3] metres. contact_forces: [N, 3] newtons.
void add_fields(const ExtrasRequest& request, const ElasticBody& body, NodesRef x,
                const Nodes& contact_forces, FrameExtras& extras);

}  // namespace nbd
