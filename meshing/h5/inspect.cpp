#include "meshing/h5/inspect.hpp"

#include <fmt/format.h>

#include <iterator>
#include <set>
#include <sstream>
#include <vector>

#include "collision/base/shortened.hpp"
#include "meshing/h5/reader.hpp"
#include "meshing/h5/sha256.hpp"
#include "meshing/progress/progress.hpp"

namespace nbd::h5 {

namespace {

class Report {
 public:
    /// follow: whether the file may hold virtual datasets, whose sources are then checked too.
    Report(const std::filesystem::path& path, bool follow) : file_(path), follow_(follow) {}

    std::string text() {
        total_ = bytes_below("/");
        add("{}: {} version {}, {} bytes\n", file_.path().string(), file_.format().name,
            file_.format().version, std::filesystem::file_size(file_.path()));
        add_attributes("/", "");
        add_children("/", "");
        check_body();
        check_sources();
        add("whole: {} datasets, {} bytes of numbers and texts, every checksum verified\n", datasets_,
            bytes_);
        return text_;
    }

 private:
    template <class... Args>
    void add(fmt::format_string<Args...> format, Args&&... args) {
        fmt::format_to(std::back_inserter(text_), format, std::forward<Args>(args)...);
    }

    /// Shortens a text to one line; recipes and options may be whole scenes.
    static std::string excerpt(std::string text) {
        constexpr std::size_t longest = 100;
        const std::size_t size = text.size();
        for (char& c : text)
            if (static_cast<unsigned char>(c) < ' ') c = ' ';
        if (size > longest) text = fmt::format("{} ({} bytes)", shortened(text, longest), size);
        return text;
    }

    void add_attributes(const std::string& object, const std::string& indent) {
        for (const std::string& name : file_.attributes(object))
            add("{}  @{} = {}\n", indent, name, excerpt(file_.attribute_text(object, name)));
    }

    void add_children(const std::string& group, const std::string& indent) {
        for (const std::string& name : file_.children(group)) {
            const std::string path = group == "/" ? name : fmt::format("{}/{}", group, name);
            if (const std::string target = file_.link_target(path); !target.empty()) {
                add("{}{} -> {}\n", indent, name, target);
            } else if (file_.is_group(path)) {
                add("{}{}/\n", indent, name);
                add_attributes(path, indent);
                add_children(path, indent + "  ");
            } else {
                add_dataset_line(path, indent + name);
            }
        }
    }

    void add_dataset_line(const std::string& path, const std::string& label) {
        if (file_.is_text(path)) {
            ++datasets_;
            const std::string text = file_.read_text(path);
            bytes_ += text.size();
            add("{}: \"{}\"\n", label, excerpt(text));
            return;
        }
        const Shape shape = file_.shape(path);
        const Type type = file_.type(path);
        if (const auto source = file_.virtual_source(path)) {
            if (!follow_)
                file_.refuse(fmt::format("'{}' is a virtual dataset", path),
                             "stored numbers, since other files refer to this one");
            add("{}: {} {} -> {}:{}\n", label, h5::name(type), h5::text(shape), source->file,
                source->dataset);
            sources_.insert(source->file);
            return;
        }
        content_hash(file_, std::vector{path});  // reads every chunk
        ++datasets_;
        bytes_ += element_count(shape) * size_of(type);
        tell_progress(fmt::format("MB of {}", file_.path().filename().string()),
                      1e-6 * static_cast<double>(bytes_), 1e-6 * static_cast<double>(total_));
        add("{}: {} {}\n", label, h5::name(type), h5::text(shape));
    }

    /// Bytes of the numbers that this file itself stores.
    std::size_t bytes_below(const std::string& group) const {
        std::size_t bytes = 0;
        for (const std::string& name : file_.children(group)) {
            const std::string path = group == "/" ? name : fmt::format("{}/{}", group, name);
            if (!file_.link_target(path).empty()) continue;
            if (file_.is_group(path))
                bytes += bytes_below(path);
            else if (!file_.is_text(path) && !file_.virtual_source(path))
                bytes += element_count(file_.shape(path)) * size_of(file_.type(path));
        }
        return bytes;
    }

    void check_body() {
        if (!file_.has_attribute("/", "body_sha256_of")) return;
        std::istringstream words(file_.attribute<std::string>("/", "body_sha256_of"));
        const std::vector<std::string> names{std::istream_iterator<std::string>(words), {}};
        const std::string stored = file_.attribute<std::string>("/", "body_sha256"),
                          is = content_hash(file_, names);
        if (stored != is)
            file_.refuse(fmt::format("the SHA-256 of the content is {}", is),
                         fmt::format("{}, the value of body_sha256", stored));
        add("body_sha256 matches the content\n");
    }

    /// Inspects the source files of the virtual datasets.
    void check_sources() {
        for (const std::string& name : sources_) {
            Report source(file_.path().parent_path() / name, false);
            source.text();
            datasets_ += source.datasets_;
            bytes_ += source.bytes_;
        }
        if (!sources_.empty())
            add("the {} source files of the virtual datasets are whole\n", sources_.size());
    }

    Reader file_;
    bool follow_;
    std::string text_;
    std::set<std::string> sources_;
    std::size_t datasets_ = 0, bytes_ = 0, total_ = 0;
};

}  // namespace

std::string inspect(const std::filesystem::path& path) { return Report(path, true).text(); }

}  // namespace nbd::h5
