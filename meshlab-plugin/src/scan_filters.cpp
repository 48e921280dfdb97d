// SPDX-License-Identifier: GPL-3.0-or-later
// Reconstruction and denoising.
#include "shared.h"

#include <cmath>
#include <vcg/complex/allocate.h>

namespace {

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

struct Denoised {
	Result result;
	atlasfit_report report;
};

/// Points of one or several layers, as the user sees them, and the columns that all of these have.
struct Scan {
	std::vector<double> xyz;
	std::vector<uint8_t> rgba;
	std::vector<double> quality;
	/// Which layer each is of, where layers are moved together.
	std::vector<uint32_t> sweep;
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
	const bool moved = par.getBool("moveLayers");
	if (moved && layers.size() < 2)
		throw std::runtime_error("atlasfit: there is one layer, which cannot be moved to others. Show those "
								 "that belong together and switch \"merge all visible layers\" on");
	Scan scan;
	for (std::size_t i = 0; i < layers.size(); ++i) {
		const MeshModel& m = *layers[i];
		add(scan, m, points(m.cm, Frame(m.cm), only_selected(m, par)), columns);
		if (moved)
			scan.sweep.resize(scan.xyz.size() / 3, uint32_t(i));
	}
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
	options.uncertainty = par.getBool("uncertainty") ? 1 : 0;
	options.uv = 0;
	atlasfit_points in = cloud(scan.xyz);
	if (faces) {
		in.triangles = faces->corners.data();
		in.triangle_count = faces->face.size();
	}
	Denoised out{nullptr, ::out<atlasfit_report>()};
	std::vector<atlasfit_attribute> attributes;
	const auto column = [&](const char* name, const void* values, uint32_t scalar) {
		attributes.push_back(defaults(atlasfit_attribute_init));
		attributes.back().name = name;
		attributes.back().values = values;
		attributes.back().scalar = scalar;
	};
	if (surface) {
		options.detail = number(par, "detail");
		options.fill_holes = length(par, "fillHoles");
		options.min_part = number(par, "minPart");
		options.largest = par.getBool("largest") ? 1 : 0;
		options.faces = count(par, "faces");
		const double own = length(par, "maxError");
		options.max_error = !par.getBool("simplify") ? 0 : own > 0 ? own : options.max_error;
		options.watertight = par.getBool("watertight") ? 1 : 0;
		options.uv = par.getBool("uv") ? 1 : 0;
		options.texture_size = count(par, "textureSize");
		if (!scan.rgba.empty()) {
			in.colors = scan.rgba.data();
			in.color_scalar = ATLASFIT_U8;
		}
		if (!scan.quality.empty())
			column("quality", scan.quality.data(), ATLASFIT_F64);
		if (!scan.sweep.empty()) {
			options.sweeps = "sweep";
			column(options.sweeps, scan.sweep.data(), ATLASFIT_U32);
		}
		in.attributes = attributes.data();
		in.attribute_count = attributes.size();
	}
	const atlasfit_run how = run(par, &bar);
	atlasfit_result* result = nullptr;
	timed(outcome, [&] { return atlasfit_denoise(&in, &options, &how, &result); });
	out.result.reset(result);
	check(atlasfit_result_report(result, &out.report));
	return out;
}

/// One number for each point or vertex that uncertainty of the options adds.
std::vector<double> told(const Denoised& fit, uint32_t array, std::size_t count)
{
	std::vector<double> values(count);
	atlasfit_buffer to = defaults(atlasfit_buffer_init);
	to.data = values.data();
	to.capacity = count;
	to.scalar = ATLASFIT_F64;
	check(atlasfit_result_copy(fit.result.get(), array, &to));
	return values;
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

/// How merged layers were moved together.
void tell_sweeps(const Denoised& fit, Outcome& outcome)
{
	const atlasfit_report& r = fit.report;
	outcome.lines.push_back("layers: " + grouped(r.sweeps) + ", " + brief(r.apart_before) +
		" apart (standard deviation with the noise), " + brief(r.apart_after) + " once moved together");
	outcome.values.push_back({"apart_before", r.apart_before});
	outcome.values.push_back({"apart_after", r.apart_after});
}

/// What became the quality, where uncertainty was asked for.
void tell_uncertainty(const Denoised& fit, Outcome& outcome)
{
	const double factor = fit.report.uncertainty_factor;
	const std::string widened = factor > 0
		? "the charts' own standard deviations times " + brief(factor)
		: std::string("not checked by the scan's own residuals");
	outcome.lines.push_back("uncertainty: " + widened + "; stored as vertex quality");
	outcome.values.push_back({"uncertainty_factor", factor});
}

} // namespace

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
	const bool sure = par.getBool("uncertainty");
	if (sure) {
		quality = told(fit, ATLASFIT_SURFACE_UNCERTAINTY, r.vertices);
	} else if (!scan.quality.empty() && r.attributes > 0) {
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
		painted.colors = are_painted(scan.rgba) ? scan.rgba.data() : nullptr;
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
	if (!scan.sweep.empty())
		tell_sweeps(fit, outcome);
	if (sure)
		tell_uncertainty(fit, outcome);
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
	const bool sure = par.getBool("uncertainty");
	std::vector<double> sd, noise;
	if (sure) {
		sd = told(fit, ATLASFIT_POINT_UNCERTAINTY, fit.report.points);
		noise = told(fit, ATLASFIT_POINT_NOISE, fit.report.points);
	}

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
		double quality = length;
		if (sure) {
			// What stays where it was keeps its noise; what is not finite has no uncertainty, and no colour.
			quality = on_surface && selection && !v.IsS() ? noise[i] : sd[i];
			quality = std::isfinite(quality) ? quality : 0;
		}
		v.Q() = typename CVertexO::QualityType(quality);
		if (select_outliers) {
			if (on_surface)
				v.ClearS();
			else
				v.SetS();
		}
	}
	update_box_and_normals(layer);

	tell(fit, outcome);
	if (sure)
		tell_uncertainty(fit, outcome);
	const double rms = moved ? std::sqrt(sum / double(moved)) : 0;
	outcome.lines.push_back("moved: " + grouped(moved) + " vertices by " + brief(rms) +
		" (root mean square), at most " + brief(most) + (sure ? "" : "; stored as vertex quality"));
	outcome.values.push_back({"moved", double(moved)});
	outcome.values.push_back({"displacement_rms", rms});
	outcome.values.push_back({"displacement_max", most});
}
