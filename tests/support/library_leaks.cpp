/// The leak sanitizer shall not take for ours what libraries lose: HDF5 1.10 and assimp where they give a
/// damaged file up, gmsh in some meshes, fontconfig once a process.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() {
    return "leak:libhdf5\nleak:libassimp\nleak:libgmsh\nleak:libfontconfig\n";
}
