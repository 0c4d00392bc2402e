// The runtime of the sanitizer looks the name up, so it must not be hidden.
/// Makes the leak sanitizer ignore leaks of libraries: HDF5 1.10 on damaged files, gmsh on some
/// meshes, fontconfig once per process.
extern "C" __attribute__((visibility("default"))) const char* __lsan_default_suppressions();
extern "C" __attribute__((visibility("default"))) const char* __lsan_default_suppressions() {
    return "leak:libhdf5\nleak:libgmsh\nleak:libfontconfig\n";
}
