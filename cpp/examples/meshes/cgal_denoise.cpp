// A scan of CGAL in, its denoised surface out: cgal_denoise scan.ply surface.ply
#include <CGAL/Point_set_3.h>
#include <CGAL/Point_set_3/IO.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh/IO.h>
#include <atlasfit/cgal.hpp>

#include <fstream>
#include <iostream>

using Point = CGAL::Simple_cartesian<double>::Point_3;

int main(int argc, char **argv) try {
  CGAL::Point_set_3<Point> points;
  CGAL::Surface_mesh<Point> surface;
  if (argc != 3 || !CGAL::IO::read_point_set(argv[1], points)) return 2;

  // atlasfit
  atlasfit::DenoiseOptions options;
  options.outliers = ATLASFIT_OUTLIERS_DROP;
  const auto clean = atlasfit::denoise(points, options);
  atlasfit::copy_surface(clean, surface);
  // done

  std::cout << points.size() << " points, " << points.garbage_size() << " outliers, "
            << surface.number_of_faces() << " faces\n";
  std::ofstream out(argv[2], std::ios::binary);
  return CGAL::IO::write_PLY(out, surface) ? 0 : 1;
} catch (const std::exception &error) {
  std::cerr << error.what() << "\n";
  return 1;
}
