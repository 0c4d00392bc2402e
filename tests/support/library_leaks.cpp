/// Makes the leak sanitizer ignore leaks of libraries: HDF5 1.10 and assimp on damaged files, gmsh on some
/// meshes, fontconfig once per process.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() {
    return "leak:libhdf5\nleak:libassimp\nleak:libgmsh\nleak:libfontconfig\n";
}
