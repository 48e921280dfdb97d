// UVs for a polygon mesh of CGAL: cgal_unwrap mesh.obj
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/boost/graph/IO/polygon_mesh_io.h>
#include <atlasfit/bgl.hpp>

#include <iostream>

using Mesh = CGAL::Surface_mesh<CGAL::Simple_cartesian<double>::Point_3>;

int main(int argc, char **argv) try {
  Mesh mesh;
  if (argc != 2 || !CGAL::IO::read_polygon_mesh(argv[1], mesh)) return 2;

  // atlasfit
  const auto layout = atlasfit::unwrap(mesh);
  const auto quality = atlasfit::measure_uv(mesh, layout);
  const atlasfit::Uv first = get(layout.uv, *halfedges(mesh).begin());
  // done

  std::cout << num_faces(mesh) << " faces in " << layout.info.charts << " charts, stretch "
            << quality.stretch_p95 << " at 95%, first UV " << first[0] << ", " << first[1] << "\n";
  return quality.flips + quality.overlapping_faces == 0 ? 0 : 1;
} catch (const std::exception &error) {
  std::cerr << error.what() << "\n";
  return 1;
}
