// UVs for a mesh of OpenMesh, sharp edges as seams: openmesh_unwrap mesh.obj
#include <OpenMesh/Core/IO/MeshIO.hh>
#include <OpenMesh/Core/Mesh/PolyMesh_ArrayKernelT.hh>
#include <atlasfit/openmesh.hpp>

#include <iostream>

int main(int argc, char **argv) try {
  OpenMesh::PolyMesh_ArrayKernelT<> mesh;
  if (argc != 2 || !OpenMesh::IO::read_mesh(mesh, argv[1])) return 2;

  // atlasfit
  mesh.request_edge_status();
  mesh.request_face_normals();
  mesh.find_feature_edges(OpenMesh::deg_to_rad(80.0f));
  const auto layout = atlasfit::unwrap(mesh);
  const auto quality = atlasfit::measure_uv(mesh);
  // done

  std::cout << mesh.n_faces() << " faces in " << layout.info.charts << " charts, stretch "
            << quality.stretch_p95 << " at 95%\n";
  return quality.flips + quality.overlapping_faces == 0 ? 0 : 1;
} catch (const std::exception &error) {
  std::cerr << error.what() << "\n";
  return 1;
}
