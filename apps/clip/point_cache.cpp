#include <cstdint>

#include "apps/clip/clip.hpp"

namespace nbd {
namespace {

template <std::endian order>
void write_positions(std::ostream& out, const Clip& clip, int body) {
    Vertices x;
    for (int frame = 0; frame < clip.frames(); ++frame) {
        clip.read(body, frame, x);
        write_numbers<order>(out, std::span<const float>(x.data(), x.size()));
    }
}

std::int32_t vertices(const Clip& clip, int body) { return clip.bodies[body].vertex_count; }

}  // namespace

void write_mdd(std::ostream& out, const Clip& clip, int body) {
    constexpr std::endian order = std::endian::big;
    write_number<order>(out, std::int32_t{clip.frames()});
    write_number<order>(out, vertices(clip, body));
    for (int frame = 0; frame < clip.frames(); ++frame) write_number<order>(out, clip.time(frame));
    write_positions<order>(out, clip, body);
}

void write_pc2(std::ostream& out, const Clip& clip, int body) {
    constexpr std::endian order = std::endian::little;
    out.write("POINTCACHE2\0", 12);
    write_number<order>(out, std::int32_t{1});  // version
    write_number<order>(out, vertices(clip, body));
    write_number<order>(out, 0.f);  // first frame
    write_number<order>(out, 1.f);  // frames from sample to sample
    write_number<order>(out, std::int32_t{clip.frames()});
    write_positions<order>(out, clip, body);
}

}  // namespace nbd
