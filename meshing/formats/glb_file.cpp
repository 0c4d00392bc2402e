#include "meshing/formats/glb_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <iterator>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "collision/base/file_text.hpp"
#include "meshing/formats/base64.hpp"
#include "meshing/formats/words.hpp"

namespace nbd {
namespace {

using nlohmann::json;

constexpr int most_values = 64;

static_assert(std::endian::native == std::endian::little, "the numbers of a .glb file are little-endian");

template <class... Args>
[[noreturn]] void refuse_glb(fmt::format_string<Args...> text, Args&&... args) {
    throw std::runtime_error("glTF: " + fmt::format(text, std::forward<Args>(args)...));
}

std::uint32_t word_at(std::string_view bytes, std::size_t at) {
    std::uint32_t word = 0;
    std::memcpy(&word, bytes.data() + at, sizeof word);
    return word;
}

/// The chunks of a file: JSON and, where there is one, binary data.
struct Chunks {
    std::string_view text;
    std::optional<std::string_view> data{};
};

Chunks chunks_of(std::string_view bytes) {
    constexpr std::size_t head = 12, chunk_head = 8;
    if (!bytes.starts_with("glTF") || bytes.size() < head + chunk_head)
        refuse_glb("the file does not start as a .glb file does");
    if (const std::uint32_t version = word_at(bytes, 4); version != 2)
        refuse_glb("it has version {}; allowed: 2", version);
    const std::uint32_t json_bytes = word_at(bytes, head);
    if (json_bytes > bytes.size() - head - chunk_head)
        refuse_glb("its JSON text has {} bytes, but the file has {}", json_bytes, bytes.size());
    if (bytes.substr(head + 4, 4) != "JSON") refuse_glb("its first chunk is not JSON");
    if (const std::uint32_t length = word_at(bytes, 8); length > bytes.size())
        refuse_glb("the file ends early: {} bytes of {}", bytes.size(), length);
    Chunks chunks{bytes.substr(head + chunk_head, json_bytes)};
    const std::size_t next = head + chunk_head + json_bytes;
    if (bytes.size() < next + chunk_head || bytes.substr(next + 4, 4) != std::string_view("BIN\0", 4))
        return chunks;
    const std::uint32_t data_bytes = word_at(bytes, next);
    if (data_bytes > bytes.size() - next - chunk_head)
        refuse_glb("the file ends early: its data have {} bytes, but {} are left", data_bytes,
                   bytes.size() - next - chunk_head);
    chunks.data = bytes.substr(next + chunk_head, data_bytes);
    return chunks;
}

/// Counts how deeply the brackets outside of strings are nested.
void check_values(std::string_view text) {
    int depth = 0;
    bool in_string = false;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (in_string && c == '\\') ++i;
        if (c == '"') in_string = !in_string;
        if (in_string) continue;
        depth += (c == '{' || c == '[') - (c == '}' || c == ']');
        if (depth > most_values) refuse_glb("values are nested more than {} deep", most_values);
    }
}

/// Whether a surface is the same with and without the extension.
bool leaves_surfaces(std::string_view extension) {
    return extension == "KHR_mesh_quantization" || extension.starts_with("KHR_materials_") ||
           extension.starts_with("KHR_texture_") || extension.starts_with("EXT_texture_") ||
           extension.starts_with("KHR_lights_") || extension == "KHR_xmp_json_ld";
}

void check_extensions(const json& file) {
    const auto required = file.find("extensionsRequired");
    if (required == file.end() || !required->is_array()) return;
    for (const json& name : *required)
        if (!name.is_string() || !leaves_surfaces(name.get_ref<const std::string&>()))
            refuse_glb(
                "the file requires the extension {}, which is not known here; allowed: "
                "KHR_mesh_quantization, "
                "or a file without it",
                name.is_string() ? printable(name.get_ref<const std::string&>()) : "of no name");
}

template <class T>
double number_at(const char* bytes) {
    T value;
    std::memcpy(&value, bytes, sizeof value);
    return value;
}

/// A component type of glTF. largest: of integers, for which normalized ones stand for shares of it.
struct ComponentType {
    int code;
    std::size_t bytes;
    double (*read)(const char* bytes);
    double largest;
    bool is_unsigned = false;
};
constexpr ComponentType component_types[] = {{5120, 1, number_at<std::int8_t>, 127},
                                             {5121, 1, number_at<std::uint8_t>, 255, true},
                                             {5122, 2, number_at<std::int16_t>, 32767},
                                             {5123, 2, number_at<std::uint16_t>, 65535, true},
                                             {5125, 4, number_at<std::uint32_t>, 4294967295., true},
                                             {5126, 4, number_at<float>, 0}};

/// Null for an unknown type.
const ComponentType* component_type(std::int64_t code) {
    const auto* const found = std::ranges::find(component_types, code, &ComponentType::code);
    return found == std::end(component_types) ? nullptr : found;
}

}  // namespace

std::int64_t json_number(const json& object, const char* key, std::int64_t fallback) {
    const auto found = object.find(key);
    if (found == object.end()) return fallback;
    if (!found->is_number_integer()) refuse_glb("\"{}\" is not a whole number", key);
    if (found->is_number_unsigned() && found->get<std::uint64_t>() > std::uint64_t{1} << 62)
        refuse_glb("\"{}\" is too large", key);
    return found->get<std::int64_t>();
}

GlbFile::GlbFile(const std::filesystem::path& path) {
    const std::string bytes = file_text(path);
    const Chunks chunks = chunks_of(bytes);
    check_values(chunks.text);
    json_ = json::parse(chunks.text, nullptr, false);
    if (!json_.is_object()) refuse_glb("its first chunk is not a JSON object");
    check_extensions(json_);
    const auto buffers = json_.find("buffers");
    if (buffers == json_.end() || !buffers->is_array()) return;
    for (const json& buffer : *buffers) {
        if (!buffer.is_object()) refuse_glb("a buffer is not an object");
        const auto uri = buffer.find("uri");
        if (uri == buffer.end() || !uri->is_string()) {
            buffers_.emplace_back(buffers_.empty() ? chunks.data.value_or("") : "");
            continue;
        }
        const auto& text = uri->get_ref<const std::string&>();
        const std::size_t comma = text.find(";base64,");
        const auto data = text.starts_with("data:") && comma != text.npos
                              ? from_base64(std::string_view(text).substr(comma + 8))
                              : std::nullopt;
        if (!data)
            refuse_glb("buffer {} lies in another file, {}; allowed: data in the file itself",
                       buffers_.size(), printable(text));
        buffers_.push_back(*data);
    }
}

const json& GlbFile::item(const char* array, std::int64_t number) const {
    const auto found = json_.find(array);
    const std::size_t count = found != json_.end() && found->is_array() ? found->size() : 0;
    if (number < 0 || static_cast<std::uint64_t>(number) >= count)
        refuse_glb("there is no {} of \"{}\", which has {}", number, array, count);
    const json& result = (*found)[number];
    if (!result.is_object()) refuse_glb("{} of \"{}\" is not an object", number, array);
    return result;
}

/// Where the numbers of an accessor are, one row after the other.
struct GlbFile::Numbers {
    std::string_view bytes;
    std::size_t stride = 0;
};

/// from: an accessor, or the part of a sparse one that names a view.
GlbFile::Numbers GlbFile::find(const json& from, std::size_t count, std::size_t components,
                               std::size_t number_bytes, bool has_stride) const {
    const std::size_t row = components * number_bytes;
    const json& view = item("bufferViews", json_number(from, "bufferView", -1));
    const std::int64_t number = json_number(view, "buffer", -1);
    if (number < 0 || number >= std::ssize(buffers_))
        refuse_glb("a view is of buffer {}, but there are {}", number, buffers_.size());
    const std::string& buffer = buffers_[number];
    const std::int64_t offset = json_number(view, "byteOffset", 0),
                       length = json_number(view, "byteLength", 0),
                       begin = json_number(from, "byteOffset", 0),
                       stride = has_stride ? json_number(view, "byteStride", static_cast<std::int64_t>(row))
                                           : static_cast<std::int64_t>(row);
    const std::int64_t size = buffer.size();
    if (offset < 0 || length < 0 || offset > size || length > size - offset)
        refuse_glb("a view takes {} bytes from {} on, but its buffer has {}", length, offset, size);
    if (begin < 0 || stride < static_cast<std::int64_t>(row) || stride > 65536)
        refuse_glb("numbers begin at byte {} and lie {} bytes apart; allowed: from 0 on, and {} to 65536",
                   begin, stride, row);
    if (begin > length ||
        (count > 0 && (count - 1) > static_cast<std::uint64_t>((length - begin) / stride)) ||
        (count > 0 &&
         static_cast<std::int64_t>((count - 1) * static_cast<std::uint64_t>(stride) + row) > length - begin))
        refuse_glb(
            "the file ends early: {} numbers of an accessor do not fit into the {} bytes of their view",
            count, length);
    return {std::string_view(buffer).substr(offset + begin, length - begin),
            static_cast<std::size_t>(stride)};
}

std::vector<double> GlbFile::numbers(std::int64_t accessor, std::size_t components) const {
    const json& from = item("accessors", accessor);
    const char* const wanted = components == 3 ? "VEC3" : "SCALAR";
    if (const auto type = from.find("type"); type == from.end() || *type != wanted)
        refuse_glb("accessor {} is not of type {}", accessor, wanted);
    const std::int64_t count = json_number(from, "count", 0);
    const std::int64_t code = json_number(from, "componentType", 0);
    const ComponentType* const number = component_type(code);
    const bool is_index = components == 1;
    if (!number || (is_index ? !number->is_unsigned : code == 5125))
        refuse_glb("accessor {} has numbers of type {}; allowed: {}", accessor, code,
                   is_index ? "5121, 5123, 5125" : "5120 to 5123, 5126");
    const auto normalized = from.find("normalized");
    const bool is_normalized = number->largest > 0 && normalized != from.end() && *normalized == true;
    constexpr std::int64_t most = 1 << 30;
    if (count < 0 || count > most)
        refuse_glb("accessor {} has {} items; allowed: 0 to {}", accessor, count, most);
    const std::size_t rows = count;
    std::vector<double> values;
    const auto read_row = [&](const Numbers& numbers, std::size_t row, double* to) {
        for (std::size_t c = 0; c < components; ++c) {
            to[c] = number->read(numbers.bytes.data() + row * numbers.stride + c * number->bytes);
            if (is_normalized) to[c] = std::max(to[c] / number->largest, -1.);
        }
    };
    if (from.contains("bufferView")) {
        const Numbers numbers = find(from, rows, components, number->bytes, true);
        values.resize(rows * components);
        for (std::size_t row = 0; row < rows; ++row) read_row(numbers, row, &values[row * components]);
    }
    const auto sparse = from.find("sparse");
    if (sparse == from.end()) {
        if (!from.contains("bufferView")) refuse_glb("accessor {} has no data", accessor);
        return values;
    }
    if (!sparse->is_object() || !sparse->contains("indices") || !sparse->contains("values") ||
        !(*sparse)["indices"].is_object() || !(*sparse)["values"].is_object())
        refuse_glb("accessor {} is sparse without indices and values", accessor);
    const std::int64_t changes = json_number(*sparse, "count", 0);
    if (changes < 0 || changes > count)
        refuse_glb("accessor {} changes {} of {} items", accessor, changes, count);
    const std::int64_t index_code = json_number((*sparse)["indices"], "componentType", 0);
    const ComponentType* const index = component_type(index_code);
    if (!index || !index->is_unsigned)
        refuse_glb("accessor {} has sparse indices of type {}; allowed: 5121, 5123, 5125", accessor,
                   index_code);
    const Numbers at = find((*sparse)["indices"], changes, 1, index->bytes, false);
    const Numbers to = find((*sparse)["values"], changes, components, number->bytes, false);
    if (values.empty() && rows > 64 * (1 + static_cast<std::size_t>(changes)))
        refuse_glb("accessor {} has {} items without data", accessor, rows - changes);
    values.resize(rows * components);
    for (std::int64_t change = 0; change < changes; ++change) {
        const std::size_t row = index->read(at.bytes.data() + change * at.stride);
        if (row >= rows) refuse_glb("accessor {} changes item {} of {}", accessor, row, rows);
        read_row(to, change, &values[row * components]);
    }
    return values;
}

std::vector<std::array<double, 3>> GlbFile::positions(std::int64_t accessor) const {
    const std::vector<double> values = numbers(accessor, 3);
    std::vector<std::array<double, 3>> rows(values.size() / 3);
    for (std::size_t i = 0; i < values.size(); ++i) rows[i / 3][i % 3] = values[i];
    return rows;
}

std::vector<std::int64_t> GlbFile::indices(std::int64_t accessor) const {
    const std::vector<double> values = numbers(accessor, 1);
    return {values.begin(), values.end()};
}

}  // namespace nbd
