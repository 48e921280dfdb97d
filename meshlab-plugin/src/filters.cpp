// SPDX-License-Identifier: GPL-3.0-or-later
#include "filters.h"

#include "layer.h"
#include "page.h"
#include "run.h"

#include <cmath>
#include <cstdio>
#include <sstream>
#include <vcg/complex/algorithms/update/color.h>
#include <vcg/complex/allocate.h>

namespace {

/// Side of a page that old textures are drawn on, in texels, at the most.
constexpr int LARGEST_PAGE = 8192;
/// The stretch that is shown in red.
constexpr double FULL_SCALE = 1.5;

/// "12,345": readable in a log.
std::string grouped(std::size_t n)
{
	std::string s = std::to_string(n);
	for (std::size_t i = s.size(); i > 3; i -= 3)
		s.insert(i - 3, ",");
	return s;
}

std::string brief(double x)
{
	char text[32];
	std::snprintf(text, sizeof text, "%.4g", x);
	return text;
}

/// The layer that the filter works on.
MeshModel& current(MeshDocument& md)
{
	if (md.mm() == nullptr)
		throw std::runtime_error("atlasfit: there is no current layer. Open a scan or a mesh first");
	return *md.mm();
}

/// Whether the user asked for the selected vertices only.
bool only_selected(const MeshModel& layer, const RichParameterList& par)
{
	if (!par.getBool("onlySelected"))
		return false;
	for (const CVertexO& v : layer.cm.vert)
		if (!v.IsD() && v.IsS())
			return true;
	throw std::runtime_error(
		"atlasfit: no vertex is selected. Select some, or switch \"only the selected vertices\" off");
}

/// A mesh for the library, and points; they borrow the arrays.
atlasfit_mesh mesh(const std::vector<double>& xyz, const std::vector<uint32_t>& corners)
{
	atlasfit_mesh in = defaults(atlasfit_mesh_init);
	in.positions = xyz.data();
	in.vertex_count = xyz.size() / 3;
	in.scalar = ATLASFIT_F64;
	in.triangles = corners.data();
	in.triangle_count = corners.size() / 3;
	return in;
}

atlasfit_points cloud(const std::vector<double>& xyz)
{
	atlasfit_points in = defaults(atlasfit_points_init);
	in.positions = xyz.data();
	in.count = xyz.size() / 3;
	in.scalar = ATLASFIT_F64;
	return in;
}

struct Denoised {
	Result result;
	atlasfit_report report;
};

/// Points of one or several layers, as the user sees them, and the columns that all of these have.
struct Scan {
	std::vector<double> xyz;
	std::vector<uint8_t> rgba;
	std::vector<double> quality;
};

/// Adds a layer's points; `columns` of MeshModel::MeshElement says which columns are kept.
void add(Scan& scan, const MeshModel& layer, const Points& from, int columns)
{
	scan.xyz.insert(scan.xyz.end(), from.xyz.begin(), from.xyz.end());
	if (columns & MeshModel::MM_VERTCOLOR) {
		const std::vector<uint8_t> rgba = colors(layer.cm, from);
		scan.rgba.insert(scan.rgba.end(), rgba.begin(), rgba.end());
	}
	if (columns & MeshModel::MM_VERTQUALITY)
		for (uint32_t vertex : from.vertex)
			scan.quality.push_back(double(layer.cm.vert[vertex].cQ()));
}

/// What a reconstruction is fitted to: the current layer, or all that are visible.
Scan scan_of(MeshDocument& md, const RichParameterList& par)
{
	std::vector<MeshModel*> layers{&current(md)};
	if (par.getBool("visibleLayers")) {
		layers.clear();
		for (MeshModel* m = md.nextVisibleMesh(); m != nullptr; m = md.nextVisibleMesh(m))
			layers.push_back(m);
		if (layers.empty())
			throw std::runtime_error("atlasfit: no layer is visible. Show some, or switch \"merge all visible "
									 "layers\" off");
	}
	int columns = MeshModel::MM_VERTCOLOR | MeshModel::MM_VERTQUALITY;
	for (int column : {int(MeshModel::MM_VERTCOLOR), int(MeshModel::MM_VERTQUALITY)})
		for (const MeshModel* m : layers)
			if (!m->hasDataMask(column))
				columns &= ~column;
	Scan scan;
	for (const MeshModel* m : layers)
		add(scan, *m, points(m->cm, Frame(m->cm), only_selected(*m, par)), columns);
	return scan;
}

/// The library's denoising of a scan. Without a `surface` outliers follow the faces.
Denoised denoise(const Scan& scan, const Triangles* faces, const RichParameterList& par, Bar& bar,
	Outcome& outcome)
{
	const bool surface = faces == nullptr;
	atlasfit_denoise_options options = defaults(atlasfit_denoise_options_init);
	options.strength = number(par, "strength");
	options.noise = length(par, "noise");
	options.charts = count(par, "charts");
	options.prior = uint32_t(par.getEnum("prior")); // the choices are in the order of ATLASFIT_PRIOR_...
	options.uv = 0;
	atlasfit_points in = cloud(scan.xyz);
	if (faces) {
		in.triangles = faces->corners.data();
		in.triangle_count = faces->face.size();
	}
	Denoised out{nullptr, ::out<atlasfit_report>()};
	atlasfit_attribute attribute = defaults(atlasfit_attribute_init);
	if (surface) {
		options.detail = number(par, "detail");
		options.fill_holes = length(par, "fillHoles");
		options.min_part = number(par, "minPart");
		options.largest = par.getBool("largest") ? 1 : 0;
		options.faces = count(par, "faces");
		options.max_error = number(par, "maxError");
		options.watertight = par.getBool("watertight") ? 1 : 0;
		options.uv = par.getBool("uv") ? 1 : 0;
		options.texture_size = count(par, "textureSize");
		if (!scan.rgba.empty()) {
			in.colors = scan.rgba.data();
			in.color_scalar = ATLASFIT_U8;
		}
		if (!scan.quality.empty()) {
			attribute.name = "quality";
			attribute.values = scan.quality.data();
			attribute.scalar = ATLASFIT_F64;
			in.attributes = &attribute;
			in.attribute_count = 1;
		}
	}
	const atlasfit_run how = run(par, &bar);
	atlasfit_result* result = nullptr;
	timed(outcome, [&] { return atlasfit_denoise(&in, &options, &how, &result); });
	out.result.reset(result);
	check(atlasfit_result_report(result, &out.report));
	return out;
}

/// The library's warnings, a line each. `get` is atlasfit_result_warnings or atlasfit_uv_warnings.
template <class Handle, class Get> void warn(const Handle* handle, Get get, Outcome& outcome)
{
	std::size_t length = 0;
	check(get(handle, nullptr, 0, &length));
	std::vector<char> text(length + 1);
	check(get(handle, text.data(), text.size(), &length));
	std::istringstream lines(text.data());
	for (std::string line; std::getline(lines, line);)
		outcome.lines.push_back("warning: " + line);
}

/// What was found in the scan.
void tell(const Denoised& fit, Outcome& outcome)
{
	const atlasfit_report& r = fit.report;
	warn(static_cast<const atlasfit_result*>(fit.result.get()), atlasfit_result_warnings, outcome);
	const std::string followed = r.followed_outliers > 0
		? " (" + grouped(r.followed_outliers) + " put between their neighbours)"
		: "";
	outcome.lines.push_back("scan: " + grouped(r.points_given) + " points, spacing " + brief(r.spacing) +
		", noise " + brief(r.noise) + ", " + grouped(r.outliers) + " on no surface" + followed + ", " +
		grouped(r.charts) + " charts");
	if (r.not_finite + r.duplicates > 0)
		outcome.lines.push_back("repairs: " + grouped(r.not_finite) + " points not finite and left out, " +
			grouped(r.duplicates) + " duplicates");
	for (const auto& v : std::vector<std::pair<const char*, double>>{{"points", double(r.points)},
			 {"outliers", double(r.outliers)}, {"followed_outliers", double(r.followed_outliers)},
			 {"not_finite", double(r.not_finite)},
			 {"duplicates", double(r.duplicates)}, {"charts", double(r.charts)}, {"spacing", r.spacing},
			 {"noise", r.noise}})
		outcome.values.push_back(v);
}

/// Gives the layer its pages and says where they are.
void keep_pages(
	MeshModel& layer, const MeshModel& beside, const std::vector<QImage>& images, Outcome& outcome)
{
	if (images.empty())
		return;
	for (const Page& p : set_pages(layer, beside, images))
		outcome.lines.push_back(p.kept ? "texture page: " + p.where : p.where);
}

void reconstruct(MeshDocument& md, const RichParameterList& par, Bar& bar, Outcome& outcome)
{
	MeshModel& source = current(md);
	check_page(par);
	const Frame frame(source.cm);
	const Scan scan = scan_of(md, par);
	bar.part(0, LAID_OUT);
	const Denoised fit = denoise(scan, nullptr, par, bar, outcome);
	const atlasfit_report& r = fit.report;

	std::vector<double> xyz(3 * r.vertices);
	std::vector<float> normals(3 * r.vertices), uv, rgba;
	Triangles surface;
	surface.corners.resize(3 * r.triangles);
	check(atlasfit_result_surface_positions(fit.result.get(), xyz.data(), xyz.size()));
	check(atlasfit_result_surface_normals(fit.result.get(), normals.data(), normals.size()));
	check(
		atlasfit_result_surface_triangles(fit.result.get(), surface.corners.data(), surface.corners.size()));
	if (r.has_uv) {
		uv.resize(6 * r.triangles);
		check(atlasfit_result_surface_corner_uv(fit.result.get(), uv.data(), uv.size()));
	}
	if (r.has_colors) {
		rgba.resize(4 * r.vertices);
		check(atlasfit_result_surface_colors(fit.result.get(), rgba.data(), rgba.size()));
	}
	std::vector<uint8_t> bytes(rgba.size());
	for (std::size_t i = 0; i < rgba.size(); ++i)
		bytes[i] = uint8_t(std::lround(255 * rgba[i]));
	std::vector<double> quality;
	if (r.attributes > 0) {
		quality.resize(r.vertices);
		check(atlasfit_result_surface_attribute(fit.result.get(), 0, quality.data(), quality.size()));
	}

	std::vector<QImage> images;
	if (!uv.empty()) {
		atlasfit_mesh page = mesh(xyz, surface.corners);
		page.corner_uv = uv.data();
		// The scan is finer than the surface's vertices.
		std::vector<double> clean(3 * r.points);
		check(atlasfit_result_point_positions(fit.result.get(), clean.data(), clean.size()));
		atlasfit_points painted = cloud(clean);
		painted.colors = scan.rgba.empty() ? nullptr : scan.rgba.data();
		painted.color_scalar = ATLASFIT_U8;
		const Sources colours{nullptr, &painted};
		images = page_images(par, int(count(par, "textureSize")), 1, page, colours, bar, outcome);
	}

	MeshModel& layer = *md.addNewMesh("", QFileInfo(source.label()).completeBaseName() + "_atlas", true);
	layer.cm.Tr = source.cm.Tr;
	layer.updateDataMask((rgba.empty() ? MeshModel::MM_NONE : MeshModel::MM_VERTCOLOR) |
		(quality.empty() ? MeshModel::MM_NONE : MeshModel::MM_VERTQUALITY));
	vcg::tri::Allocator<CMeshO>::AddVertices(layer.cm, r.vertices);
	vcg::tri::Allocator<CMeshO>::AddFaces(layer.cm, r.triangles);
	surface.face.resize(r.triangles);
	for (std::size_t i = 0; i < r.vertices; ++i) {
		CVertexO& v = layer.cm.vert[i];
		v.P() = frame.position_back(&xyz[3 * i]);
		if (!bytes.empty())
			v.C() = vcg::Color4b(bytes[4 * i], bytes[4 * i + 1], bytes[4 * i + 2], bytes[4 * i + 3]);
		if (!quality.empty())
			v.Q() = typename CVertexO::QualityType(quality[i]);
	}
	for (std::size_t i = 0; i < r.triangles; ++i) {
		surface.face[i] = uint32_t(i);
		for (int k = 0; k < 3; ++k)
			layer.cm.face[i].V(k) = &layer.cm.vert[surface.corners[3 * i + std::size_t(k)]];
	}
	update_box_and_normals(layer);
	// The atlas knows the normals better than the triangles do.
	for (std::size_t i = 0; i < r.vertices; ++i)
		layer.cm.vert[i].N() = frame.normal_back(&normals[3 * i]);
	if (!uv.empty()) {
		set_corner_uv(layer, surface, uv, {});
		keep_pages(layer, source, images, outcome);
	}

	tell(fit, outcome);
	outcome.lines.push_back("surface: " + grouped(r.vertices) + " vertices, " + grouped(r.triangles) +
		" faces, " + grouped(r.parts) + (r.parts == 1 ? " part, " : " parts, ") + grouped(r.boundary_edges) +
		" boundary edges in " + grouped(r.boundary_loops) + " loops, " + grouped(r.filled_holes) +
		" holes filled, " + grouped(r.uv_charts) + " UV charts" + (r.one_sided ? ", one-sided" : ""));
	if (r.dropped_parts > 0)
		outcome.lines.push_back("left out: " + grouped(r.dropped_parts) +
			(r.dropped_parts == 1 ? " part with " : " parts with ") + grouped(r.dropped_points) + " points");
	for (const auto& v : std::vector<std::pair<const char*, double>>{{"vertices", double(r.vertices)},
			 {"faces", double(r.triangles)}, {"parts", double(r.parts)},
			 {"dropped_parts", double(r.dropped_parts)}, {"dropped_points", double(r.dropped_points)},
			 {"boundary_edges", double(r.boundary_edges)}, {"boundary_loops", double(r.boundary_loops)},
			 {"uv_charts", double(r.uv_charts)}, {"one_sided", double(r.one_sided)}, {"voxel", r.voxel}})
		outcome.values.push_back(v);
}

void denoise_vertices(
	MeshDocument& md, const RichParameterList& par, Bar& bar, Outcome& outcome)
{
	MeshModel& layer = current(md);
	const Frame frame(layer.cm);
	const bool selection = only_selected(layer, par);
	const Points from = points(layer.cm, frame, false);
	const Triangles faces = triangles(layer.cm, from);
	Scan scan;
	add(scan, layer, from, MeshModel::MM_NONE);
	const Denoised fit = denoise(scan, &faces, par, bar, outcome);
	std::vector<double> xyz(3 * fit.report.points);
	std::vector<float> normals(3 * fit.report.points);
	std::vector<uint32_t> chart(fit.report.points);
	check(atlasfit_result_point_positions(fit.result.get(), xyz.data(), xyz.size()));
	check(atlasfit_result_point_normals(fit.result.get(), normals.data(), normals.size()));
	check(atlasfit_result_point_charts(fit.result.get(), chart.data(), chart.size()));

	layer.updateDataMask(MeshModel::MM_VERTQUALITY);
	const bool select_outliers = par.getBool("selectOutliers"), cloud = layer.cm.fn == 0;
	std::size_t moved = 0;
	double sum = 0, most = 0;
	for (std::size_t i = 0; i < from.vertex.size(); ++i) {
		CVertexO& v = layer.cm.vert[from.vertex[i]];
		const bool on_surface = chart[i] != UINT32_MAX;
		const double d[3] = {xyz[3 * i] - from.xyz[3 * i], xyz[3 * i + 1] - from.xyz[3 * i + 1],
			xyz[3 * i + 2] - from.xyz[3 * i + 2]};
		const double way = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
		double length = 0;
		// Outliers that follow their neighbours have another place; the others stay to the last bit, and what
		// is not finite has no way.
		if ((on_surface || way > 0) && (!selection || v.IsS())) {
			length = std::sqrt(way);
			v.P() = frame.position_back(&xyz[3 * i]);
			if (cloud)
				v.N() = frame.normal_back(&normals[3 * i]);
			++moved;
			sum += length * length;
			most = std::max(most, length);
		}
		v.Q() = typename CVertexO::QualityType(length);
		if (select_outliers) {
			if (on_surface)
				v.ClearS();
			else
				v.SetS();
		}
	}
	update_box_and_normals(layer);

	tell(fit, outcome);
	const double rms = moved ? std::sqrt(sum / double(moved)) : 0;
	outcome.lines.push_back("moved: " + grouped(moved) + " vertices by " + brief(rms) +
		" (root mean square), at most " + brief(most) + "; stored as vertex quality");
	outcome.values.push_back({"moved", double(moved)});
	outcome.values.push_back({"displacement_rms", rms});
	outcome.values.push_back({"displacement_max", most});
}

/// Quality of the UVs that `in` has, for the log and for scripts.
void measure(const atlasfit_mesh& in, const atlasfit_run& how, std::vector<float>* stretch, Outcome& outcome)
{
	auto q = out<atlasfit_uv_quality>();
	timed(outcome, [&] {
		return atlasfit_measure_uv(
			&in, &how, &q, stretch ? stretch->data() : nullptr, stretch ? stretch->size() : 0);
	});
	outcome.lines.push_back("UVs: " + grouped(q.charts) + " charts, seams " + brief(q.seam) +
		" times the square root of the area, " + brief(100 * q.coverage) + "% of the texture covered");
	outcome.lines.push_back("stretch: median " + brief(q.stretch_median) + ", 95% of the area below " +
		brief(q.stretch_p95) + ", L2 " + brief(q.stretch_l2) + ", conformal " + brief(q.conformal));
	outcome.lines.push_back("faults: " + grouped(q.flips) + " flipped, " + grouped(q.overlapping_faces) +
		" overlapping, " + grouped(q.degenerate) + " collapsed faces" +
		(q.inside ? "" : "; UVs leave the page") + (q.finite ? "" : "; some UVs are not finite"));
	for (const auto& v : std::vector<std::pair<const char*, double>>{{"charts", double(q.charts)},
			 {"seam", q.seam}, {"stretch_median", q.stretch_median}, {"stretch_p95", q.stretch_p95},
			 {"stretch_l2", q.stretch_l2}, {"stretch_linf", q.stretch_linf}, {"conformal", q.conformal},
			 {"flips", double(q.flips)}, {"overlapping_faces", double(q.overlapping_faces)},
			 {"collapsed", double(q.degenerate)}, {"coverage", q.coverage}, {"inside", double(q.inside)}})
		outcome.values.push_back(v);
}

void parametrize(MeshDocument& md, const RichParameterList& par, Bar& bar, Outcome& outcome)
{
	MeshModel& layer = current(md);
	check_page(par);
	const Frame frame(layer.cm);
	const Points from = points(layer.cm, frame, false);
	const Triangles faces = triangles(layer.cm, from);
	atlasfit_unwrap_options options = defaults(atlasfit_unwrap_options_init);
	check(atlasfit_unwrap_options_set_preset(&options, uint32_t(par.getEnum("preset"))));
	if (const double own = number(par, "maxStretch"); own != 0)
		options.max_stretch = own;
	options.max_charts = count(par, "maxCharts");
	options.keep_uv_seams = par.getBool("keepSeams") ? 1 : 0;
	options.hard_edge_angle = number(par, "hardEdges");
	options.page_width = options.page_height = count(par, "textureSize");
	options.padding = count(par, "padding");
	options.pages = count(par, "pages");
	options.texels_per_unit = number(par, "density");
	options.packer = par.getEnum("packer") == 0 ? ATLASFIT_PACK_SHAPES : ATLASFIT_PACK_BOXES;
	atlasfit_mesh in = mesh(from.xyz, faces.corners);
	std::vector<float> old;
	if (options.keep_uv_seams) {
		if (!layer.hasDataMask(MeshModel::MM_WEDGTEXCOORD))
			throw std::runtime_error(
				"atlasfit: the layer has no per-wedge texture coordinates whose seams could be kept");
		old = corner_uv(layer.cm, faces);
		in.corner_uv = old.data();
	}
	// Colours that the layer's textures have go on a page that keeps their detail.
	const OldTextures textures = par.getEnum("texture") == TEXTURE_COLORS ? OldTextures(layer, faces, outcome)
																		  : OldTextures();
	const atlasfit_textures before = textures.c();
	double density = 0;
	if (!textures.empty()) {
		uint32_t side = 0, padding = 0;
		const atlasfit_run how = run(par, nullptr);
		timed(outcome,
			[&] { return atlasfit_textures_page(&in, &before, &how, &side, &padding, &density); });
		options.page_width = options.page_height = std::max(options.page_width, side);
		options.padding = std::max(options.padding, padding);
	}
	const std::vector<uint32_t> polygon = polygons(layer.cm, faces);
	if (!polygon.empty())
		in.face_polygon = polygon.data();
	bar.part(0, LAID_OUT);
	const atlasfit_run how = run(par, &bar);
	atlasfit_uv* made = nullptr;
	timed(outcome, [&] { return atlasfit_unwrap(&in, &options, &how, &made); });
	const Uv owned(made);
	auto info = out<atlasfit_uv_info>();
	check(atlasfit_uv_get_info(made, &info));
	warn(static_cast<const atlasfit_uv*>(made), atlasfit_uv_warnings, outcome);
	std::vector<float> uv(6 * info.triangles);
	std::vector<uint32_t> pages(info.triangles);
	check(atlasfit_uv_corners(made, uv.data(), uv.size()));
	check(atlasfit_uv_face_pages(made, pages.data(), pages.size()));

	std::vector<uint8_t> rgba;
	atlasfit_mesh laid = mesh(from.xyz, faces.corners);
	laid.corner_uv = uv.data();
	laid.face_page = pages.data();
	if (layer.hasDataMask(MeshModel::MM_VERTCOLOR)) {
		rgba = colors(layer.cm, from);
		laid.colors = rgba.data();
		laid.color_scalar = ATLASFIT_U8;
	}
	int size = int(info.width);
	for (double texels = info.texels_per_unit; texels < density && size < LARGEST_PAGE; texels *= 2)
		size *= 2;
	const Sources colours{textures.empty() ? nullptr : &before, nullptr};
	const std::vector<QImage> images = page_images(par, size, info.pages, laid, colours, bar, outcome);
	if (!textures.empty())
		outcome.lines.push_back("textures: " + grouped(textures.images.size()) + " drawn anew at " +
			grouped(std::size_t(size)) + " x " + grouped(std::size_t(size)) + " texels");
	else if (images.empty() && !layer.cm.textures.empty())
		outcome.lines.push_back("warning: the textures that the layer has no longer fit its UVs");

	set_corner_uv(layer, faces, uv, pages);
	outcome.lines.push_back("charts: " + grouped(info.charts) + " on " + grouped(info.pages) +
		(info.pages == 1 ? " page, " : " pages, ") + brief(info.texels_per_unit) + " texels per unit" +
		(info.stretch_bound > options.max_stretch ? "; stretch bound raised to " + brief(info.stretch_bound)
												  : ""));
	for (const auto& said : std::vector<std::pair<std::size_t, const char*>>{
			 {info.degenerate_faces, "faces without area got small UV triangles"},
			 {info.duplicate_faces, "faces that repeat another got UVs of their own"},
			 {info.non_manifold_edges,
				 "edges where more than two faces, or two that face apart, meet were cut"}})
		if (said.first > 0)
			outcome.lines.push_back(grouped(said.first) + " " + said.second);
	keep_pages(layer, layer, images, outcome);
	outcome.values.push_back({"pages", double(info.pages)});
	outcome.values.push_back({"texels_per_unit", info.texels_per_unit});
	measure(laid, run(par, nullptr), nullptr, outcome);
}

void distortion(MeshDocument& md, const RichParameterList& par, Bar& bar, Outcome& outcome)
{
	MeshModel& layer = current(md);
	if (!layer.hasDataMask(MeshModel::MM_WEDGTEXCOORD))
		throw std::runtime_error("atlasfit: the layer has no per-wedge texture coordinates to measure");
	const Frame frame(layer.cm);
	const Points from = points(layer.cm, frame, false);
	const Triangles faces = triangles(layer.cm, from);
	const std::vector<float> uv = corner_uv(layer.cm, faces);
	const std::vector<uint32_t> pages = face_pages(layer.cm, faces);
	atlasfit_mesh in = mesh(from.xyz, faces.corners);
	in.corner_uv = uv.data();
	in.face_page = pages.data();
	std::vector<float> stretch(faces.face.size());
	measure(in, run(par, &bar), &stretch, outcome);

	// Infinity would spoil the host's colour maps and histograms; how many have collapsed is in the log.
	float largest = 1;
	for (float s : stretch)
		if (std::isfinite(s))
			largest = std::max(largest, s);
	layer.updateDataMask(MeshModel::MM_FACEQUALITY);
	for (std::size_t i = 0; i < faces.face.size(); ++i)
		layer.cm.face[faces.face[i]].Q() =
			typename CFaceO::QualityType(std::isfinite(stretch[i]) ? stretch[i] : largest);
	if (par.getBool("colorize")) {
		layer.updateDataMask(MeshModel::MM_FACECOLOR);
		vcg::tri::UpdateColor<CMeshO>::PerFaceQualityRamp(layer.cm, Coordinate(FULL_SCALE), 1);
	}
	outcome.values.push_back({"largest", double(largest)});
}

} // namespace

Outcome apply(int filter, const RichParameterList& par, MeshDocument& md, vcg::CallBackPos* progress)
{
	// While the major version is 0, the minor one decides.
	if (atlasfit_version() >> 16 != ATLASFIT_VERSION >> 16)
		throw std::runtime_error("atlasfit: the plugin was built for another version of libatlasfit than the "
								 "one that was loaded. Build it again");
	Outcome outcome;
	Bar bar(progress);
	switch (filter) {
	case RECONSTRUCT: reconstruct(md, par, bar, outcome); break;
	case DENOISE: denoise_vertices(md, par, bar, outcome); break;
	case PARAMETRIZE: parametrize(md, par, bar, outcome); break;
	case DISTORTION: distortion(md, par, bar, outcome); break;
	default: throw std::runtime_error("atlasfit: no such filter");
	}
	outcome.lines.push_back("libatlasfit took " + brief(outcome.library_seconds) + " s");
	outcome.values.push_back({"library_seconds", outcome.library_seconds});
	if (progress)
		progress(100, "done");
	return outcome;
}
