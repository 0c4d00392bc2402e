#include "meshing/formats/vtu.hpp"

#include <fmt/format.h>

#include <bit>
#include <cstdint>
#include <cstring>
#include <stdexcept>

#include "meshing/h5/atomic_file.hpp"
#include "meshing/surface/quadratic_tets.hpp"

namespace nbd {
namespace {

/// The appended data block of a .vtu file: arrays, each after its length in bytes (UInt64).
class Appended {
 public:
    /// Returns the offset of the array, to be stored in its XML element.
    template <class T>
    std::size_t add(const std::vector<T>& values) {
        const std::size_t offset = bytes_.size();
        const std::uint64_t length = values.size() * sizeof(T);
        bytes_.resize(offset + sizeof(length) + length);
        std::memcpy(bytes_.data() + offset, &length, sizeof(length));
        if (length > 0) std::memcpy(bytes_.data() + offset + sizeof(length), values.data(), length);
        return offset;
    }
    const std::string& bytes() const { return bytes_; }

 private:
    std::string bytes_;
};

void check(std::span<const VtuBody> bodies) {
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        const VtuBody& body = bodies[b];
        bool fits = body.mesh && body.start && body.x && body.v && body.contact_force && body.von_mises &&
                    body.von_mises->size() == body.mesh->T.rows();
        if (fits)
            for (const Nodes* field : {body.start, body.v, body.contact_force})
                fits = fits && field->rows() == body.x->rows();
        if (!fits)
            throw std::invalid_argument(fmt::format(
                "vtu: body {} needs one row per node in every node field, one von_mises per tetrahedron", b));
    }
}

/// Values of a field at the corners of tetrahedra and, of quadratic ones, in the middle of their edges.
/// nodes: those of its nodes.
Nodes at_points(const TetMesh& mesh, Nodes nodes) {
    const Nodes given = nodes;
    for (Eigen::Index t = 0; t < mesh.E.rows(); ++t)
        for (std::size_t k = 0; k < edges_of_tet.size(); ++k) {
            const auto [a, b] = edges_of_tet[k];
            nodes.row(mesh.E(t, k)) =
                0.5 * given.row(mesh.E(t, k)) + 0.25 * (given.row(mesh.T(t, a)) + given.row(mesh.T(t, b)));
        }
    return nodes;
}

void append(std::vector<float>& out, NodesRef rows) {
    for (Eigen::Index i = 0; i < rows.size(); ++i) out.push_back(static_cast<float>(rows.data()[i]));
}

}  // namespace

void write_vtu(const std::filesystem::path& path, std::span<const VtuBody> bodies,
               const Eigen::Vector3d& origin) {
    check(bodies);
    const bool is_far = !origin.isZero(0);
    std::vector<double> far_points;
    std::vector<float> points, displacement, velocity, contact_force, von_mises;
    std::vector<std::int64_t> connectivity, offsets;
    std::vector<std::uint8_t> types;
    std::vector<std::int32_t> owner;
    std::int64_t first_node = 0;
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        const VtuBody& body = bodies[b];
        const TetMesh& mesh = *body.mesh;
        const Nodes x = at_points(mesh, *body.x);
        if (!is_far) append(points, x);
        if (is_far)
            for (Eigen::Index i = 0; i < x.rows(); ++i)
                for (int k = 0; k < 3; ++k) far_points.push_back(x(i, k) + origin[k]);
        append(displacement, x - at_points(mesh, *body.start));
        append(velocity, at_points(mesh, *body.v));
        append(contact_force, *body.contact_force);
        for (Eigen::Index t = 0; t < mesh.T.rows(); ++t) {
            for (const int node : mesh.T.row(t)) connectivity.push_back(first_node + node);
            if (mesh.is_quadratic())
                for (const int k : {0, 3, 1, 2, 4, 5}) connectivity.push_back(first_node + mesh.E(t, k));
            offsets.push_back(connectivity.size());
            types.push_back(mesh.is_quadratic() ? 24 : 10);  // VTK_QUADRATIC_TETRA, VTK_TETRA
            owner.push_back(b);
            von_mises.push_back(static_cast<float>((*body.von_mises)[t]));
        }
        first_node += body.x->rows();
    }
    Appended data;
    const auto array = [](const char* type, const char* name, int components, std::size_t offset) {
        return fmt::format(
            R"(<DataArray type="{}" Name="{}" NumberOfComponents="{}" format="appended" offset="{}"/>)", type,
            name, components, offset);
    };
    std::string text = fmt::format(
        R"(<?xml version="1.0"?>
<VTKFile type="UnstructuredGrid" version="1.0" byte_order="{}" header_type="UInt64">
<UnstructuredGrid>
<Piece NumberOfPoints="{}" NumberOfCells="{}">
)",
        std::endian::native == std::endian::little ? "LittleEndian" : "BigEndian", first_node, owner.size());
    text += "<Points>" +
            (is_far ? array("Float64", "points", 3, data.add(far_points))
                    : array("Float32", "points", 3, data.add(points))) +
            "</Points>\n";
    text += "<Cells>" + array("Int64", "connectivity", 1, data.add(connectivity)) +
            array("Int64", "offsets", 1, data.add(offsets)) + array("UInt8", "types", 1, data.add(types)) +
            "</Cells>\n";
    text += R"(<PointData Vectors="velocity">)" +
            array("Float32", "displacement", 3, data.add(displacement)) +
            array("Float32", "velocity", 3, data.add(velocity)) +
            array("Float32", "contact_force", 3, data.add(contact_force)) + "</PointData>\n";
    text += R"(<CellData Scalars="von_mises">)" + array("Int32", "body", 1, data.add(owner)) +
            array("Float32", "von_mises", 1, data.add(von_mises)) + "</CellData>\n";
    text += "</Piece>\n</UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_";
    text += data.bytes();
    text += "\n</AppendedData>\n</VTKFile>\n";
    h5::AtomicFile file(path);
    file.out() << text;
    file.commit();
}

VtuSeries::VtuSeries(std::filesystem::path directory, std::string name)
    : directory_(std::move(directory)), name_(std::move(name)) {
    std::error_code error;
    std::filesystem::create_directories(directory_, error);
    if (error)
        throw std::runtime_error(
            fmt::format("{}: cannot create the directory: {}", directory_.string(), error.message()));
}

std::string VtuSeries::frame_name(std::size_t frame) const {
    return fmt::format("{}_{:06}.vtu", name_, frame);
}

void VtuSeries::add_frame(double time, std::span<const VtuBody> bodies, const Eigen::Vector3d& origin) {
    write_vtu(directory_ / frame_name(times_.size()), bodies, origin);
    times_.push_back(time);
    std::string text =
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\">\n<Collection>\n";
    for (std::size_t f = 0; f < times_.size(); ++f)
        text += fmt::format("<DataSet timestep=\"{}\" part=\"0\" file=\"{}\"/>\n", times_[f], frame_name(f));
    h5::AtomicFile file(pvd());
    file.out() << text << "</Collection>\n</VTKFile>\n";
    file.commit();
}

}  // namespace nbd
