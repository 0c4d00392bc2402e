from spack_repo.builtin.build_systems.cmake import CMakePackage

from spack.package import *


class Nbdtree(CMakePackage):
    """Deformable solids with learned collision culling: a simulator, collision queries and training of their bounds."""

    homepage = "https://example.org/nbdtree"  # of the project, when it has one
    git = "https://example.org/nbdtree.git"

    license("GPL-3.0-or-later")  # of the binaries, which link gmsh and CGAL; the code is under the MIT licence

    version("0.2.0", tag="v0.2.0")

    variant("python", default=False, description="Build the Python package")

    depends_on("c", type="build")
    depends_on("cxx", type="build")
    depends_on("cmake@3.25:", type="build")
    depends_on("ninja", type="build")
    depends_on("pkgconfig", type="build")
    depends_on("arpack-ng+icb")
    depends_on("blas")
    depends_on("cgal@5.5:")
    depends_on("cli11", type="build")
    depends_on("cpp-httplib")
    depends_on("eigen@3.4")
    depends_on("fmt")
    depends_on("gmsh@4.8:")
    depends_on("hdf5@1.10:")
    depends_on("libpng")
    depends_on("nlohmann-json", type="build")
    depends_on("openssl")
    depends_on("suite-sparse")
    depends_on("tbb")
    depends_on("zlib-api")
    with when("+python"):
        extends("python")
        depends_on("python@3.11:", type=("build", "link", "run"))
        depends_on("py-numpy", type="run")
        depends_on("py-pybind11@2.12:", type="build")

    resource(
        name="three",
        url="https://registry.npmjs.org/three/-/three-0.111.0.tgz",
        sha256="c0f06a76cad7d725a8a21d11d1de145e1f574d68cb130ab2f153e0c1c289bf41",
        placement="three",
    )

    def cmake_args(self):
        three = join_path(self.stage.source_path, "three")
        return [
            self.define("NBD_NATIVE", False),  # Spack's compilers add the target's instruction set
            self.define("NBD_TESTS", False),
            self.define("NBD_BENCH", False),
            self.define_from_variant("NBD_PYTHON", "python"),
            self.define("NBD_JS_three", join_path(three, "build", "three.min.js")),
            self.define("NBD_JS_OrbitControls", join_path(three, "examples", "js", "controls", "OrbitControls.js")),
        ]

    def install(self, spec, prefix):
        components = ["program", "development"]
        with working_dir(self.build_directory):
            for component in components:
                cmake("--install", ".", "--component", component, "--prefix", prefix)
        if "+python" in spec:
            install_tree(join_path(self.build_directory, "python", "nbdtree"), join_path(python_platlib, "nbdtree"))
