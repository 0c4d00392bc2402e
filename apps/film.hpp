#pragma once

#include <filesystem>
#include <vector>

#include "apps/picture.hpp"
#include "sim/world.hpp"

namespace nbd {

/// A scene in one picture: a few frames side by side, each body in a colour of its own.
class Film {
 public:
    /// Of `frames` frames, `stills` evenly spread ones are kept, first and last among them.
    Film(int frames, int stills);

    /// Keeps the frame if its turn has come. Frames come in order.
    void add_frame(int frame, const World& world);

    /// Writes the stills kept so far as a PNG, `columns` in a row.
    void write(const std::filesystem::path& path, int columns) const;

 private:
    bool wants(int frame) const;

    int frames_, stills_;
    std::vector<Faces> faces_;                 // [bodies]
    std::vector<std::vector<Vertices>> kept_;  // [stills][bodies]
};

}  // namespace nbd
