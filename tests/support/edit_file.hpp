#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <ostream>
#include <string>
#include <vector>

namespace nbd::test {

/// Edits one of our HDF5 files with plain HDF5 and valid checksums, as a foreign program might.
class EditFile {
 public:
    using Shape = std::vector<std::uint64_t>;

    explicit EditFile(const std::filesystem::path& path);
    ~EditFile();
    EditFile(const EditFile&) = delete;
    EditFile& operator=(const EditFile&) = delete;

    void remove(const std::string& name);

    void replace(const std::string& name, const Shape& shape, const std::vector<float>& v);
    void replace(const std::string& name, const Shape& shape, const std::vector<double>& v);
    void replace(const std::string& name, const Shape& shape, const std::vector<int>& v);

    /// Creates a float64 dataset of the given shape without storing data.
    void reserve(const std::string& name, const Shape& shape);

    /// Makes `name` a link to a dataset in another file, or a dataset of 6 numbers that are bytes of one.
    void link_elsewhere(const std::string& name, const std::string& file, const std::string& dataset);
    void store_elsewhere(const std::string& name, const std::string& file);

    /// Changes one number of a dataset in place. The type of `value` must be the stored type.
    void set(const std::string& name, std::size_t index, int value);
    void set(const std::string& name, std::size_t index, float value);
    void set(const std::string& name, std::size_t index, double value);

    void set_attribute(const std::string& object, const std::string& name, double value);
    void set_attribute(const std::string& object, const std::string& name, int value);
    void set_attribute(const std::string& object, const std::string& name, const std::string& value);
    void remove_attribute(const std::string& object, const std::string& name);

 private:
    std::int64_t file_;
};

/// An edit of a file, and what its reader then says behind the path, in part.
struct BrokenFile {
    const char* what;
    void (*edit)(EditFile&);
    friend std::ostream& operator<<(std::ostream& out, const BrokenFile& b) { return out << b.what; }
};

/// Edits the file, and expects `load` to refuse it in one such line.
void expect_refused(const std::filesystem::path& path, const BrokenFile& broken,
                    const std::function<void(const std::filesystem::path&)>& load);

}  // namespace nbd::test
