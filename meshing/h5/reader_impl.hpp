#pragma once

#include <string>

#include "meshing/h5/library.hpp"
#include "meshing/h5/reader.hpp"

// For the .cpp files of this folder: an nbdtree file open for reading.
namespace nbd::h5 {

struct Reader::Impl {
    std::filesystem::path path;
    std::size_t bytes = 0;
    DrivenFile driven;
    Handle file;
    Format format;
    std::string kept_name;  // the dataset that read_rows() keeps open
    Handle kept;

    /// Throws std::runtime_error with path, what it is and what was allowed if it is not an nbdtree file.
    explicit Impl(const std::filesystem::path& path);
    ~Impl();
    Impl(const Impl&) = delete;
    Impl& operator=(const Impl&) = delete;

    /// Throws std::runtime_error "path: what; allowed: allowed".
    [[noreturn]] void refuse(const std::string& what, const std::string& allowed) const;
    /// Throws ReadError if the system could not read the file. Call it where HDF5 would give an answer like
    /// another.
    void check_reads() const;
    /// Like refuse(), with the reason of the HDF5 call that has just failed; or check_reads().
    [[noreturn]] void refuse_damaged(const std::string& item) const;

    /// As of Reader. Each of these throws if the item is missing or of another kind. Texts may have fixed or
    /// variable length.
    bool has(const std::string& name) const;
    Handle open_object(const std::string& name) const;
    Handle open_dataset(const std::string& name) const;
    Handle open_attribute(const std::string& object, const std::string& name) const;
    std::string text_attribute(const std::string& object, const std::string& name) const;
    std::string text_dataset(const std::string& name) const;
    /// value: of memory type `type`. The attribute must hold one number that converts to it.
    void number_attribute(const std::string& object, const std::string& name, Type type, void* value) const;
};

}  // namespace nbd::h5
