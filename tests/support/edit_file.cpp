#include "tests/support/edit_file.hpp"

#include <hdf5.h>

#include <stdexcept>

#include "tests/support/error_of.hpp"
#include "tests/support/file_damage.hpp"

namespace nbd::test {
namespace {

void replace_dataset(hid_t file, const std::string& name, const EditFile::Shape& shape, hid_t stored,
                     hid_t memory, const void* values) {
    if (H5Lexists(file, name.c_str(), H5P_DEFAULT) > 0) H5Ldelete(file, name.c_str(), H5P_DEFAULT);
    const std::vector<hsize_t> sizes(shape.begin(), shape.end());
    const hid_t space = H5Screate_simple(sizes.size(), sizes.data(), nullptr);
    const hid_t dataset =
        H5Dcreate2(file, name.c_str(), stored, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    if (values) H5Dwrite(dataset, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, values);
    H5Dclose(dataset), H5Sclose(space);
}

template <class T>
void set_number(hid_t file, const std::string& name, std::size_t index, T value) {
    const hid_t dataset = H5Dopen2(file, name.c_str(), H5P_DEFAULT), space = H5Dget_space(dataset),
                type = H5Tget_native_type(H5Dget_type(dataset), H5T_DIR_ASCEND);
    std::vector<T> values(H5Sget_simple_extent_npoints(space));
    H5Dread(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
    values.at(index) = value;
    H5Dwrite(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
    H5Sclose(space), H5Tclose(type), H5Dclose(dataset);
}

void replace_attribute(hid_t file, const std::string& object, const std::string& name, hid_t stored,
                       hid_t memory, const void* value) {
    const hid_t target = H5Oopen(file, object.c_str(), H5P_DEFAULT), space = H5Screate(H5S_SCALAR);
    if (H5Aexists(target, name.c_str()) > 0) H5Adelete(target, name.c_str());
    const hid_t attribute = H5Acreate2(target, name.c_str(), stored, space, H5P_DEFAULT, H5P_DEFAULT);
    H5Awrite(attribute, memory, value);
    H5Aclose(attribute), H5Sclose(space), H5Oclose(target);
}

}  // namespace

EditFile::EditFile(const std::filesystem::path& path)
    : file_(H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT)) {
    if (file_ < 0) throw std::runtime_error("cannot edit " + path.string());
}

EditFile::~EditFile() { H5Fclose(file_); }

void EditFile::remove(const std::string& name) { H5Ldelete(file_, name.c_str(), H5P_DEFAULT); }

void EditFile::replace(const std::string& name, const Shape& shape, const std::vector<float>& v) {
    replace_dataset(file_, name, shape, H5T_IEEE_F32LE, H5T_NATIVE_FLOAT, v.data());
}
void EditFile::replace(const std::string& name, const Shape& shape, const std::vector<double>& v) {
    replace_dataset(file_, name, shape, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, v.data());
}
void EditFile::replace(const std::string& name, const Shape& shape, const std::vector<int>& v) {
    replace_dataset(file_, name, shape, H5T_STD_I32LE, H5T_NATIVE_INT, v.data());
}

void EditFile::reserve(const std::string& name, const Shape& shape) {
    replace_dataset(file_, name, shape, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, nullptr);
}

void EditFile::link_elsewhere(const std::string& name, const std::string& file, const std::string& dataset) {
    H5Lcreate_external(file.c_str(), dataset.c_str(), file_, name.c_str(), H5P_DEFAULT, H5P_DEFAULT);
}

void EditFile::store_elsewhere(const std::string& name, const std::string& file) {
    const hsize_t count = 6;
    const hid_t space = H5Screate_simple(1, &count, nullptr), creation = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_external(creation, file.c_str(), 0, 6 * sizeof(float));
    const hid_t dataset =
        H5Dcreate2(file_, name.c_str(), H5T_IEEE_F32LE, space, H5P_DEFAULT, creation, H5P_DEFAULT);
    H5Dclose(dataset), H5Pclose(creation), H5Sclose(space);
}

void EditFile::set(const std::string& name, std::size_t index, int value) {
    set_number(file_, name, index, value);
}
void EditFile::set(const std::string& name, std::size_t index, float value) {
    set_number(file_, name, index, value);
}
void EditFile::set(const std::string& name, std::size_t index, double value) {
    set_number(file_, name, index, value);
}

void EditFile::set_attribute(const std::string& object, const std::string& name, double value) {
    replace_attribute(file_, object, name, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, &value);
}
void EditFile::set_attribute(const std::string& object, const std::string& name, int value) {
    replace_attribute(file_, object, name, H5T_STD_I32LE, H5T_NATIVE_INT, &value);
}
void EditFile::set_attribute(const std::string& object, const std::string& name, const std::string& value) {
    const hid_t type = H5Tcopy(H5T_C_S1);
    H5Tset_size(type, value.size());
    replace_attribute(file_, object, name, type, type, value.data());
    H5Tclose(type);
}
void EditFile::remove_attribute(const std::string& object, const std::string& name) {
    H5Adelete_by_name(file_, object.c_str(), name.c_str(), H5P_DEFAULT);
}

void expect_refused(const std::filesystem::path& path, const BrokenFile& broken,
                    const std::function<void(const std::filesystem::path&)>& load) {
    {
        EditFile file(path);
        broken.edit(file);
    }
    const std::string error = error_of([&] { load(path); });
    expect_clear(error, path);
    EXPECT_NE(error.find(broken.what), std::string::npos) << error;
}

}  // namespace nbd::test
