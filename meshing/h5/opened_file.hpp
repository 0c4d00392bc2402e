#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "meshing/h5/library.hpp"

// For the .cpp files of this folder: an nbdtree file open for reading.
namespace nbd::h5 {

class OpenedFile {
 public:
    /// Throws std::runtime_error with path, what it is and what was allowed if it is not an nbdtree file.
    explicit OpenedFile(const std::filesystem::path& path);
    ~OpenedFile();
    OpenedFile(const OpenedFile&) = delete;
    OpenedFile& operator=(const OpenedFile&) = delete;

    const std::filesystem::path& path() const noexcept { return path_; }
    const Format& format() const noexcept { return format_; }
    std::size_t bytes() const noexcept { return bytes_; }
    hid_t id() const noexcept { return file_.get(); }

    /// Throws std::runtime_error "path: what; allowed: allowed".
    [[noreturn]] void refuse(const std::string& what, const std::string& allowed) const;
    /// Throws ReadError if the system could not read the file. Call it where HDF5 would give an answer like
    /// another.
    void check_reads() const;
    /// Like refuse(), with the reason of the HDF5 call that has just failed; or check_reads().
    [[noreturn]] void refuse_damaged(const std::string& item) const;

    /// Whether a group, dataset or link has this name.
    bool has(const std::string& name) const;

    /// Each of these throws if the item is missing or of another kind. Texts may have fixed or variable
    /// length.
    Handle open_object(const std::string& name) const;
    Handle open_dataset(const std::string& name) const;
    Handle open_attribute(const std::string& object, const std::string& name) const;
    std::string text_attribute(const std::string& object, const std::string& name) const;
    std::string text_dataset(const std::string& name) const;
    /// value: of memory type `type`. The attribute must hold one number that converts to it.
    void number_attribute(const std::string& object, const std::string& name, Type type, void* value) const;

 private:
    std::filesystem::path path_;
    std::size_t bytes_ = 0;
    DrivenFile driven_;
    Handle file_;
    Format format_;
};

}  // namespace nbd::h5
