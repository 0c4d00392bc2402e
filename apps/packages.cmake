# Packages of Debian: the program, the collision library with its headers, and the Python package. apps/package makes
# them from a build for any x86-64.
set(CPACK_GENERATOR DEB)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL program development python)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_PACKAGE_CONTACT "the developers of nbdtree")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "Deformable solids with learned collision culling")
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)

set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME nbdtree)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_DEPENDS "libopenblas0-pthread")  # which factorisations are slow without
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SUGGESTS "python3-matplotlib")  # for charts
set(CPACK_COMPONENT_PROGRAM_DESCRIPTION "The program nbdtree: scenes, datasets, training and collision queries.")

set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libnbdtree-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "libeigen3-dev (>= 3.4)")
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "The collision library nbd::collision with its headers, for find_package(nbdtree).")

set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-nbdtree)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SHLIBDEPS ON)
# The module is for one minor version of Python, that of the release of Debian.
if(NBD_PYTHON)
    find_package(Python3 REQUIRED COMPONENTS Interpreter)
    math(EXPR next_minor "${Python3_VERSION_MINOR} + 1")
    set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS
        "libopenblas0-pthread, python3 (>= 3.${Python3_VERSION_MINOR}), python3 (<< 3.${next_minor}), python3-numpy")
endif()
set(CPACK_DEBIAN_PYTHON_PACKAGE_SUGGESTS "python3-matplotlib")
set(CPACK_COMPONENT_PYTHON_DESCRIPTION "The Python package nbdtree, with examples in /usr/share/nbdtree.")
include(CPack)
