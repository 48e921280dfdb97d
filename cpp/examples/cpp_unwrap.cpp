// A mesh (OBJ) in, the same mesh with UVs out: cpp_unwrap mesh.obj unwrapped.obj [max_stretch]
#include <atlasfit.hpp>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>

int main(int argc, char **argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: %s MESH.obj OUT.obj [MAX_STRETCH]\n", argv[0]);
    return 2;
  }
  try {
    // Vertices, and the corners of the faces one after the other.
    std::vector<double> xyz;
    std::vector<unsigned long> corners, offsets = {0};
    std::ifstream in(argv[1]);
    std::string line, word;
    while (std::getline(in, line)) {
      std::istringstream words(line);
      words >> word;
      if (word == "v") {
        double p[3];
        if (!(words >> p[0] >> p[1] >> p[2])) throw std::runtime_error("a vertex without three coordinates");
        xyz.insert(xyz.end(), p, p + 3);
      } else if (word == "f") {
        while (words >> word) corners.push_back(std::strtoul(word.c_str(), nullptr, 10) - 1);
        offsets.push_back(corners.size());
      }
      word.clear();
    }

    atlasfit::UnwrapOptions options;
    if (argc > 3) options.max_stretch = std::atof(argv[3]);
    atlasfit::Mesh mesh(xyz, atlasfit::Faces(corners.data(), offsets.data(), offsets.size() - 1));
    const atlasfit::UvLayout layout = atlasfit::unwrap(mesh, options);
    const std::vector<float> uv = layout.corners();

    std::ofstream out(argv[2]);
    out.precision(9);
    for (std::size_t v = 0; v < xyz.size(); v += 3)
      out << "v " << xyz[v] << ' ' << xyz[v + 1] << ' ' << xyz[v + 2] << '\n';
    for (std::size_t c = 0; c < uv.size(); c += 2) out << "vt " << uv[c] << ' ' << uv[c + 1] << '\n';
    for (std::size_t f = 1; f < offsets.size(); f++) {
      out << 'f';
      for (std::size_t c = offsets[f - 1]; c < offsets[f]; c++) out << ' ' << corners[c] + 1 << '/' << c + 1;
      out << '\n';
    }
    if (!out) throw std::runtime_error("the output cannot be written");

    const atlasfit_uv_quality q = atlasfit::measure_uv(mesh.corner_uv(uv.data()));
    std::printf("%zu faces in %zu charts, stretch %.3f at 95%%, %.0f%% of the page used\n",
                layout.info().faces, layout.info().charts, q.stretch_p95, 100.0 * q.coverage);
    return q.flips + q.overlapping_faces == 0 ? 0 : 1;
  } catch (const std::exception &error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
