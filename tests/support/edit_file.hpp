#pragma once

#include <hdf5.h>

#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

namespace nbd::test {

/// Edits one of our HDF5 files with plain HDF5 and valid checksums, as a foreign program might.
class EditFile {
 public:
    explicit EditFile(const std::filesystem::path& path)
        : file_(H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT)) {
        if (file_ < 0) throw std::runtime_error("cannot edit " + path.string());
    }
    ~EditFile() { H5Fclose(file_); }

    void remove(const std::string& name) { H5Ldelete(file_, name.c_str(), H5P_DEFAULT); }

    void replace(const std::string& name, std::vector<hsize_t> shape, const std::vector<float>& v) {
        replace(name, shape, H5T_IEEE_F32LE, H5T_NATIVE_FLOAT, v.data());
    }
    void replace(const std::string& name, std::vector<hsize_t> shape, const std::vector<double>& v) {
        replace(name, shape, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, v.data());
    }
    void replace(const std::string& name, std::vector<hsize_t> shape, const std::vector<int>& v) {
        replace(name, shape, H5T_STD_I32LE, H5T_NATIVE_INT, v.data());
    }

    /// Creates a float64 dataset of the given shape without storing data.
    void reserve(const std::string& name, std::vector<hsize_t> shape) {
        replace(name, shape, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, nullptr);
    }

    /// Changes one number of a dataset in place. T must be the stored type.
    template <class T>
    void set(const std::string& name, std::size_t index, T value) {
        const hid_t dataset = H5Dopen2(file_, name.c_str(), H5P_DEFAULT), space = H5Dget_space(dataset),
                    type = H5Tget_native_type(H5Dget_type(dataset), H5T_DIR_ASCEND);
        std::vector<T> values(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)));
        H5Dread(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
        values.at(index) = value;
        H5Dwrite(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
        H5Sclose(space), H5Tclose(type), H5Dclose(dataset);
    }

    void set_attribute(const std::string& object, const std::string& name, double value) {
        set_attribute(object, name, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, &value);
    }
    void set_attribute(const std::string& object, const std::string& name, int value) {
        set_attribute(object, name, H5T_STD_I32LE, H5T_NATIVE_INT, &value);
    }
    void set_attribute(const std::string& object, const std::string& name, const std::string& value) {
        const hid_t type = H5Tcopy(H5T_C_S1);
        H5Tset_size(type, value.size());
        set_attribute(object, name, type, type, value.data());
        H5Tclose(type);
    }
    void remove_attribute(const std::string& object, const std::string& name) {
        H5Adelete_by_name(file_, object.c_str(), name.c_str(), H5P_DEFAULT);
    }

 private:
    void replace(const std::string& name, const std::vector<hsize_t>& shape, hid_t stored, hid_t memory,
                 const void* values) {
        if (H5Lexists(file_, name.c_str(), H5P_DEFAULT) > 0) remove(name);
        const hid_t space = H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr);
        const hid_t dataset =
            H5Dcreate2(file_, name.c_str(), stored, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
        if (values) H5Dwrite(dataset, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, values);
        H5Dclose(dataset), H5Sclose(space);
    }
    void set_attribute(const std::string& object, const std::string& name, hid_t stored, hid_t memory,
                       const void* value) {
        const hid_t target = H5Oopen(file_, object.c_str(), H5P_DEFAULT), space = H5Screate(H5S_SCALAR);
        if (H5Aexists(target, name.c_str()) > 0) H5Adelete(target, name.c_str());
        const hid_t attribute = H5Acreate2(target, name.c_str(), stored, space, H5P_DEFAULT, H5P_DEFAULT);
        H5Awrite(attribute, memory, value);
        H5Aclose(attribute), H5Sclose(space), H5Oclose(target);
    }

    hid_t file_;
};

}  // namespace nbd::test
