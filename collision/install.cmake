# `cmake --install` puts nbd::collision where find_package(nbdtree) finds it.
include(CMakePackageConfigHelpers)
include(CheckCXXSourceCompiles)

# Eigen aligns arrays by the instruction set that a file is compiled for, and arrays pass between the library and
# the programs that embed it: one would free what the other allocated otherwise. So programs get the library's own
# alignment, whatever they are compiled for. Compiled for the same instruction set they would have it anyway.
if(NBD_NATIVE)
    set(CMAKE_REQUIRED_FLAGS -march=native)
endif()
set(CMAKE_REQUIRED_LIBRARIES Eigen3::Eigen)
foreach(bytes 16 32 64)
    check_cxx_source_compiles("
        #include <Eigen/Core>
        static_assert(EIGEN_MAX_ALIGN_BYTES == ${bytes} && EIGEN_MAX_STATIC_ALIGN_BYTES == ${bytes});
        int main() {}" NBD_EIGEN_ALIGNS_TO_${bytes})
    if(NBD_EIGEN_ALIGNS_TO_${bytes})
        target_compile_definitions(nbd_collision INTERFACE
            $<INSTALL_INTERFACE:EIGEN_MAX_ALIGN_BYTES=${bytes}>
            $<INSTALL_INTERFACE:EIGEN_MAX_STATIC_ALIGN_BYTES=${bytes}>)
        set(alignment_is_known ON)
    endif()
endforeach()
if(NOT alignment_is_known)
    message(FATAL_ERROR "Eigen aligns neither to 16 nor 32 nor 64 bytes: programs could not be given its alignment")
endif()

set(NBD_PACKAGE_FOLDER lib/cmake/nbdtree)
set_target_properties(nbd_collision PROPERTIES EXPORT_NAME collision)
install(TARGETS nbd_collision EXPORT nbdtreeTargets ARCHIVE DESTINATION lib)
install(EXPORT nbdtreeTargets NAMESPACE nbd:: DESTINATION ${NBD_PACKAGE_FOLDER})
install(DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR} DESTINATION include/nbdtree FILES_MATCHING PATTERN "*.hpp")
configure_package_config_file(nbdtreeConfig.cmake.in nbdtreeConfig.cmake INSTALL_DESTINATION ${NBD_PACKAGE_FOLDER})
write_basic_package_version_file(nbdtreeConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/nbdtreeConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/nbdtreeConfigVersion.cmake
    DESTINATION ${NBD_PACKAGE_FOLDER})
