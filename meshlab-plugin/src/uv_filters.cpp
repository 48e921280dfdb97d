// SPDX-License-Identifier: GPL-3.0-or-later
// Parametrization, and the distortion of UVs.
#include "shared.h"

#include <algorithm>
#include <cmath>
#include <vcg/complex/algorithms/update/color.h>

namespace {

/// Side of a page that old textures are drawn on, in texels, at the most.
constexpr int LARGEST_PAGE = 8192;
/// The stretch that is shown in red.
constexpr double FULL_SCALE = 1.5;

/// Quality of the UVs that `in` has, for the log and for scripts.
void measure(const atlasfit_mesh& in, const atlasfit_run& how, std::vector<float>* stretch, Outcome& outcome)
{
	auto q = out<atlasfit_uv_quality>();
	timed(outcome, [&] {
		return atlasfit_measure_uv(
			&in, &how, &q, stretch ? stretch->data() : nullptr, stretch ? stretch->size() : 0);
	});
	outcome.lines.push_back("UVs: " + grouped(q.charts) + " charts, seams " + brief(q.seam) +
		" times the square root of the area, " + brief(100 * q.coverage) + "% of the texture covered, " +
		brief(100 * q.straightness) + "% of the outlines along the page's sides");
	outcome.lines.push_back("stretch: median " + brief(q.stretch_median) + ", 95% of the area below " +
		brief(q.stretch_p95) + ", L2 " + brief(q.stretch_l2) + ", conformal " + brief(q.conformal));
	outcome.lines.push_back("faults: " + grouped(q.flips) + " flipped, " + grouped(q.overlapping_faces) +
		" overlapping, " + grouped(q.degenerate) + " collapsed faces" +
		(q.inside ? "" : "; UVs leave the page") + (q.finite ? "" : "; some UVs are not finite"));
	for (const auto& v : std::vector<std::pair<const char*, double>>{{"charts", double(q.charts)},
			 {"seam", q.seam}, {"stretch_median", q.stretch_median}, {"stretch_p95", q.stretch_p95},
			 {"stretch_l2", q.stretch_l2}, {"stretch_linf", q.stretch_linf}, {"conformal", q.conformal},
			 {"flips", double(q.flips)}, {"overlapping_faces", double(q.overlapping_faces)},
			 {"collapsed", double(q.degenerate)}, {"coverage", q.coverage}, {"inside", double(q.inside)},
			 {"straightness", q.straightness}})
		outcome.values.push_back(v);
}

/// Lays out UVs as `options` say, and draws pages for them.
void lay_out(MeshModel& layer, atlasfit_unwrap_options options, const RichParameterList& par, Bar& bar,
	Outcome& outcome)
{
	check_page(par);
	const Frame frame(layer.cm);
	const Points from = points(layer.cm, frame, false);
	const Triangles faces = triangles(layer.cm, from);
	options.page_width = options.page_height = count(par, "textureSize");
	options.padding = count(par, "padding");
	options.pages = count(par, "pages");
	options.texels_per_unit = number(par, "density");
	options.packer = par.getEnum("packer") == 0 ? ATLASFIT_PACK_SHAPES : ATLASFIT_PACK_BOXES;
	atlasfit_mesh in = mesh(from.xyz, faces.corners);
	std::vector<float> old;
	std::vector<uint32_t> old_pages;
	if (options.keep_uv_seams || options.keep_uvs) {
		if (!layer.hasDataMask(MeshModel::MM_WEDGTEXCOORD))
			throw std::runtime_error(std::string("atlasfit: the layer has no per-wedge texture coordinates ") +
				(options.keep_uvs ? "that could be packed. Use \"Parametrization: Atlas\" first"
								  : "whose seams could be kept"));
		old = corner_uv(layer.cm, faces);
		in.corner_uv = old.data();
	}
	if (options.keep_uvs) {
		old_pages = face_pages(layer.cm, faces);
		in.face_group = old_pages.data(); // charts of two pages may meet at the same coordinates
	}
	// Colours that the layer's textures have go on a page that keeps their detail.
	const OldTextures textures = par.getEnum("texture") == TEXTURE_COLORS ? OldTextures(layer, faces, outcome)
																		  : OldTextures();
	if (options.stack != ATLASFIT_STACK_NONE && !textures.empty())
		throw std::runtime_error("atlasfit: parts that are stacked share their texels, so the layer's textures "
								 "cannot be drawn anew. Set \"Texture page\" to none, or \"Stack\"");
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
	std::vector<float> price;
	if (!options.keep_uvs && par.getBool("seamPrice")) {
		if (!layer.hasDataMask(MeshModel::MM_VERTQUALITY))
			throw std::runtime_error("atlasfit: the layer has no vertex quality that could say what seams cost. "
									 "Compute or paint it, or turn \"Quality prices seams\" off");
		for (uint32_t vertex : from.vertex)
			price.push_back(float(layer.cm.vert[vertex].cQ()));
		in.seam_price = price.data();
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
		laid.colors = are_painted(rgba) ? rgba.data() : nullptr;
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
	if (info.stacked_parts > 0)
		outcome.lines.push_back("stacked: " + grouped(info.stacked_parts) + " parts on others of their shape");
	if (info.straightened_charts > 0)
		outcome.lines.push_back("straightened: " + grouped(info.straightened_charts) + " charts");
	keep_pages(layer, layer, images, outcome);
	outcome.values.push_back({"pages", double(info.pages)});
	outcome.values.push_back({"texels_per_unit", info.texels_per_unit});
	measure(laid, run(par, nullptr), nullptr, outcome);
}

} // namespace

void parametrize(MeshDocument& md, const RichParameterList& par, Bar& bar, Outcome& outcome)
{
	MeshModel& layer = current(md);
	atlasfit_unwrap_options options = defaults(atlasfit_unwrap_options_init);
	check(atlasfit_unwrap_options_set_preset(&options, uint32_t(par.getEnum("preset"))));
	if (const double own = number(par, "maxStretch"); own != 0)
		options.max_stretch = own;
	options.max_charts = count(par, "maxCharts");
	options.keep_uv_seams = par.getBool("keepSeams") ? 1 : 0;
	options.hard_edge_angle = number(par, "hardEdges");
	options.seams_hidden = number(par, "seamsHidden");
	options.stack = uint32_t(par.getEnum("stack"));
	options.straighten = par.getBool("straighten") ? ATLASFIT_STRAIGHTEN_AUTO : ATLASFIT_STRAIGHTEN_OFF;
	lay_out(layer, options, par, bar, outcome);
}

void pack(MeshDocument& md, const RichParameterList& par, Bar& bar, Outcome& outcome)
{
	MeshModel& layer = current(md);
	atlasfit_unwrap_options options = defaults(atlasfit_unwrap_options_init);
	options.keep_uvs = 1;
	lay_out(layer, options, par, bar, outcome);
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
