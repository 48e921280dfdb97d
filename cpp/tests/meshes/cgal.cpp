// atlasfit/cgal.hpp: point sets with garbage, colours, normals, other properties; surfaces as Surface_mesh.
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Point_set_3.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <atlasfit/cgal.hpp>

#include "common.hpp"

#include <map>

using K = CGAL::Exact_predicates_inexact_constructions_kernel;
using Points = CGAL::Point_set_3<K::Point_3>;
using FloatPoints = CGAL::Point_set_3<CGAL::Simple_cartesian<float>::Point_3>;
using Mesh = CGAL::Surface_mesh<K::Point_3>;

/// A noisy sphere of 4,000 points with colours, normals, a label, a number, text; every tenth point is
/// removed, and the last three are strays far away.
template <class Set>
Set scan() {
  using Point = typename Set::Point_3;
  using Vector = typename Set::Vector_3;
  Set set;
  set.add_normal_map();
  auto id = set.template add_property_map<int>("id", 0).first;
  auto height = set.template add_property_map<float>("height", 0.0f).first;
  auto text = set.template add_property_map<std::string>("text", "").first;
  std::array<typename Set::template Property_map<unsigned char>, 3> rgb;
  const char *names[3] = {"red", "green", "blue"};
  for (std::size_t c = 0; c < 3; c++)
    rgb[c] = set.template add_property_map<unsigned char>(names[c], 0).first;
  auto all = noisy_sphere(4000);
  for (const double far : {6.0, 7.0, 8.0}) all.push_back({far, 0.5 * far, 0.0});
  int n = 0;
  for (const auto &p : all) {
    const auto at = *set.insert(atlasfit::detail::point_at<Point>(p.data()));
    set.normal(at) = atlasfit::detail::point_at<Vector>(p.data());
    id[at] = n;
    height[at] = static_cast<float>(p[2]);
    text[at] = "point " + std::to_string(n++);
    rgb[0][at] = p[2] > 0 ? 255 : 0;
    rgb[2][at] = 77;
  }
  for (std::size_t i = 0; i < 4000; i += 10) set.remove(typename Set::Index(static_cast<unsigned>(i)));
  return set;
}

template <class Set>
double mean_off_sphere(const Set &set) {
  double sum = 0.0;
  std::size_t n = 0;
  for (const auto &i : set) {
    const auto p = atlasfit::detail::coordinates(set.point(i));
    if (std::abs(p[0]) < 2.0) sum += off_sphere(p[0], p[1], p[2]), n++;
  }
  return sum / static_cast<double>(n);
}

/// id and text of each point, by id: what a point that stays must keep.
template <class Set>
std::map<int, std::string> tags(const Set &set) {
  const auto id = set.template property_map<int>("id").first;
  const auto text = set.template property_map<std::string>("text").first;
  std::map<int, std::string> all;
  for (const auto &i : set) all[id[i]] = text[i];
  return all;
}

template <class Set>
std::vector<std::string> sorted_properties(const Set &set) {
  auto all = set.properties();
  std::sort(all.begin(), all.end());
  return all;
}

template <class Set>
void all_points_stay() {
  Set set = scan<Set>();
  const Set before = set;
  const double noisy = mean_off_sphere(set);
  want(stops([&] { atlasfit::denoise(set, {}, stopping()); }) && mean_off_sphere(set) == noisy,
       "a callback that throws leaves the points");
  const auto clean = atlasfit::denoise(set);
  want(set.size() == 3603 && set.garbage_size() == 400 && clean.report().points_given == 3603,
       "points stay, garbage stays garbage");
  want(tags(set) == tags(before) && sorted_properties(set) == sorted_properties(before), "properties stay");
  want(mean_off_sphere(set) < 0.5 * noisy, "points are on the surface");
  auto a = set.begin();
  for (const auto &b : before) want(*a++ == b, "the order stays");
  const auto id = set.template property_map<int>("id").first;
  for (const auto &i : set) {
    if (id[i] >= 4000) {
      want(set.point(i) == before.point(i) && set.normal(i) == before.normal(i), "strays stay exactly");
    } else {
      const auto n = atlasfit::detail::coordinates(set.normal(i)),
                 p = atlasfit::detail::coordinates(set.point(i));
      want(atlasfit::detail::dot(n, p) > 0.9, "normals are turned to the surface");
    }
  }
}

template <class Set>
void strays_are_dropped() {
  atlasfit::DenoiseOptions options;
  options.outliers = ATLASFIT_OUTLIERS_DROP;
  const Set before = scan<Set>();
  Set set = before;
  const auto clean = atlasfit::denoise(set, options);
  const std::size_t dropped = clean.report().outliers;
  want(dropped >= 3 && set.size() == 3603 - dropped && set.garbage_size() == 400 + dropped,
       "strays are garbage");
  auto kept = tags(set), all = tags(before);
  want(kept.count(4000) + kept.count(4001) + kept.count(4002) == 0, "those far away are gone");
  want(std::includes(all.begin(), all.end(), kept.begin(), kept.end()), "the others keep their properties");
  const auto other = atlasfit::denoised(before, options);
  want(tags(before) == all && other.points.size() == set.size() && !other.points.has_garbage(), "a new set");
  want(tags(other.points) == kept && sorted_properties(other.points) == sorted_properties(before),
       "as in place");
  set.collect_garbage();
  want(tags(set) == kept && mean_off_sphere(set) == mean_off_sphere(other.points),
       "garbage can be collected");
  auto a = set.begin();
  for (const auto &b : other.points) want(set.point(*a++) == other.points.point(b), "in the same order");
}

static void surface_carries_all() {
  Points set = scan<Points>();
  const auto clean = atlasfit::denoise(set);
  Mesh mesh;
  want(atlasfit::copy_surface(clean, mesh) == 0 && mesh.is_valid(), "no face is refused");
  want(mesh.number_of_vertices() == clean.report().vertices &&
           mesh.number_of_faces() == clean.report().triangles,
       "all vertices and faces");
  const auto normal = mesh.property_map<Mesh::Vertex_index, K::Vector_3>("v:normal");
  const auto color = mesh.property_map<Mesh::Vertex_index, CGAL::IO::Color>("v:color");
  const auto id = mesh.property_map<Mesh::Vertex_index, int>("v:id");
  const auto height = mesh.property_map<Mesh::Vertex_index, float>("v:height");
  const auto uv = mesh.property_map<Mesh::Halfedge_index, atlasfit::Uv>("h:uv");
  const auto chart = mesh.property_map<Mesh::Face_index, std::uint32_t>("f:chart");
  want(normal.second && color.second && id.second && height.second && uv.second && chart.second,
       "properties");
  const auto none = mesh.property_map<Mesh::Vertex_index, unsigned char>("v:red");
  want(!none.second, "colours are no attributes");
  for (const auto v : mesh.vertices()) {
    want(std::abs(height.first[v] - mesh.point(v).z()) < 0.2, "a number is averaged");
    want(id.first[v] >= 0 && id.first[v] < 4000 && id.first[v] % 10 != 0, "a label is that of a point");
    want(color.first[v].blue() == 77 && color.first[v].alpha() == 255, "colours");
    want(normal.first[v] * (mesh.point(v) - CGAL::ORIGIN) > 0.8, "normals");
  }
  for (const auto f : mesh.faces()) want(chart.first[f] < clean.report().uv_charts, "charts");
  const auto q = atlasfit::measure_uv(mesh, uv.first);
  want(q.flips + q.overlapping_faces == 0 && q.faces == mesh.number_of_faces(), "UVs");
}

/// Colours of CGAL's own type count as well as channels do.
static void colours_in_one_property() {
  Points set = scan<Points>();
  auto color = set.add_property_map<CGAL::IO::Color>("color").first;
  for (const auto &i : set) color[i] = CGAL::IO::Color(10, 20, 30);
  Mesh mesh;
  atlasfit::copy_surface(atlasfit::denoise(set), mesh);
  const auto found = mesh.property_map<Mesh::Vertex_index, CGAL::IO::Color>("v:color").first;
  for (const auto v : mesh.vertices()) want(found[v] == CGAL::IO::Color(10, 20, 30), "the property color");
}

/// Three triangles at an edge, one triangle twice, one that names a vertex twice.
static void refused_faces_are_counted() {
  atlasfit::Surface book;
  book.xyz = {0, 0, 0, 0, 0, 1, 1, 0, 0, 0, 1, 0, -1, 0, 0};
  book.triangles = {0, 1, 2, 1, 0, 3, 0, 1, 4, 0, 1, 2, 0, 0, 3};
  Mesh mesh;
  want(atlasfit::copy_surface(book, mesh) == 3 && mesh.is_valid(), "refused faces are counted");
  want(mesh.number_of_faces() == 5 && mesh.number_of_vertices() == 5 + 9, "and have vertices of their own");
  book.triangles[4] = 9;
  want(status_of([&] { atlasfit::copy_surface(book, mesh); }) == ATLASFIT_INDEX_OUT_OF_RANGE,
       "a wrong index");
  book.triangles[4] = 0;
  book.normals.resize(4);
  want(status_of([&] { atlasfit::copy_surface(book, mesh); }) == ATLASFIT_INVALID_ARGUMENT, "a short array");
  want(mesh.number_of_faces() == 5, "a failure adds nothing");
}

static void failures() {
  Points none;
  want(status_of([&] { atlasfit::denoise(none); }) == ATLASFIT_EMPTY_INPUT, "no points");
  // Points that are not finite are counted and stay.
  Points set = scan<Points>();
  set.point(*set.begin()) = K::Point_3(std::nan(""), 0, 0);
  const auto clean = atlasfit::denoise(set);
  want(clean.report().not_finite == 1 && set.size() == 3603 && std::isnan(set.point(*set.begin()).x()),
       "a point that is not finite stays");
}

int main() {
  all_points_stay<Points>();
  all_points_stay<FloatPoints>();
  strays_are_dropped<Points>();
  strays_are_dropped<FloatPoints>();
  surface_carries_all();
  colours_in_one_property();
  refused_faces_are_counted();
  failures();
  want(atlasfit_live_handles() == 0, "no handle is left");
  return verdict();
}
