# Installs nbd::collision as a package that find_package(nbdtree) finds.
include(CMakePackageConfigHelpers)
include(CheckCXXSourceCompiles)

# Eigen aligns arrays by the instruction set that a file is compiled for. The library and the programs that embed it
# exchange arrays, so with different alignments one could not free what the other allocated. The package therefore gives
# programs the library's alignment, whatever they are compiled for.
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
        target_compile_definitions(nbd_base INTERFACE
            $<INSTALL_INTERFACE:EIGEN_MAX_ALIGN_BYTES=${bytes}>
            $<INSTALL_INTERFACE:EIGEN_MAX_STATIC_ALIGN_BYTES=${bytes}>)
        set(alignment_is_known ON)
    endif()
endforeach()
if(NOT alignment_is_known)
    message(FATAL_ERROR "Eigen aligns to none of 16, 32 and 64 bytes, so the package cannot pass on its alignment")
endif()

set(NBD_PACKAGE_FOLDER lib/cmake/nbdtree)
set(rooms base geometry kernels bounds nbd_tree wide_tree tree query continuous flat)
set(targets)
foreach(room ${rooms} collision)
    set_target_properties(nbd_${room} PROPERTIES EXPORT_NAME ${room})
    list(APPEND targets nbd_${room})
endforeach()
target_include_directories(nbd_base INTERFACE $<INSTALL_INTERFACE:include>)
install(TARGETS ${targets} EXPORT nbdtreeTargets ARCHIVE DESTINATION lib COMPONENT development)
install(EXPORT nbdtreeTargets NAMESPACE nbd:: DESTINATION ${NBD_PACKAGE_FOLDER} COMPONENT development)
configure_package_config_file(nbdtreeConfig.cmake.in nbdtreeConfig.cmake INSTALL_DESTINATION ${NBD_PACKAGE_FOLDER})
write_basic_package_version_file(nbdtreeConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/nbdtreeConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/nbdtreeConfigVersion.cmake
    DESTINATION ${NBD_PACKAGE_FOLDER} COMPONENT development)

# Programs that embed the library include "collision/..." as <nbdtree/...>.
install(CODE "set(source ${CMAKE_CURRENT_SOURCE_DIR})" COMPONENT development)
install(CODE [[
    file(GLOB_RECURSE headers RELATIVE ${source} ${source}/*.hpp)
    foreach(header ${headers})
        file(READ ${source}/${header} text)
        string(REPLACE "#include \"collision/" "#include \"nbdtree/" text "${text}")
        set(installed "$ENV{DESTDIR}${CMAKE_INSTALL_PREFIX}/include/nbdtree/${header}")
        file(WRITE "${installed}" "${text}")
        list(APPEND CMAKE_INSTALL_MANIFEST_FILES "${installed}")
    endforeach()]] COMPONENT development)
