// SPDX-License-Identifier: GPL-3.0-or-later
// What the host shows of the filters: names, help and parameters.
#include "filters.h"

#include "run.h"

#include <array>

namespace {

const char* const PAPER = "<br>See: Gadelha et al., <b>Deep Manifold Prior</b>, 2020.";
const char* const STRETCH_PAPER =
	"<br>See: P. Sander et al., <b>Texture Mapping Progressive Meshes</b>, SIGGRAPH 2001.";
const char* const FRAME = "<br>Lengths are those that you see: the layer's matrix is applied.";

Parameter texture_parameter()
{
	// No file without being asked.
	return {Parameter::ENUM, "texture", double(PAGES_ARE_FILES ? TEXTURE_NONE : TEXTURE_COLORS), "Texture page",
		"<b>Colours</b>: those of the textures that the layer has, else of its vertices; without either no "
		"page is made. <b>Checker</b>: squares look square and equally large "
		"where the UVs are good. <b>None</b>: no page is made." +
			QString(PAGES_ARE_FILES ? " A page is written as a file beside the layer's." : ""),
		{"Colours", "Checker", "None"}, false};
}

Parameter texture_size_parameter(uint32_t value)
{
	return {Parameter::INT, "textureSize", double(value), "Page size (texels)",
		"Side of the square texture page, 16 to 65536. The gaps between charts follow from it.", {}, false};
}

std::vector<Parameter> denoise_parameters(bool surface)
{
	const atlasfit_denoise_options o = defaults(atlasfit_denoise_options_init);
	std::vector<Parameter> list{
		{Parameter::BOOL, "onlySelected", 0,
			surface ? "Only the selected vertices" : "Move only the selected vertices",
			surface ? "The surface is fitted to the selected vertices, the others are left out."
					: "The surface is fitted to all vertices, but only the selected ones are moved.",
			{}, false},
		{Parameter::FLOAT, "strength", o.strength, "Strength",
			"How strongly to denoise, 0 or more: 1 = as much as the scan asks for, 2 = smoother, 0 = the points "
			"stay where they are.",
			{}, false},
		{Parameter::LENGTH, "noise", o.noise, "Noise",
			"Standard deviation of the scan's noise along the normal. 0 = it is estimated.",
			{}, false},
		{Parameter::ENUM, "prior", double(o.prior), "Prior",
			"What smooth means. <b>Gaussian process</b>: the limit that the paper's networks tend to as they "
			"grow wide. <b>Networks</b>: the paper's networks, "
			"trained on the scan first; many times slower. <b>Convolutional networks</b>: another kind of "
			"them. <b>Level set</b>: one network for all, closed surfaces only.",
			{"Gaussian process", "Networks", "Convolutional networks", "Level set"}, true},
		{Parameter::INT, "charts", double(o.charts), "Charts",
			"Number of charts to aim for. 0 = as many as the shape needs.", {}, true},
		{Parameter::BOOL, "uncertainty", double(o.uncertainty), "Uncertainty",
			QString("Whether to say how sure the result is: the quality of ") +
				(surface ? "the surface's vertices becomes " : "the vertices becomes, in place of how far they moved, ") +
				"their standard deviation along the normal. <i>Colorize by vertex Quality</i> shows it." +
				(surface ? "" : " Of vertices on no surface it is the distance from the nearest that is on one, "
								"of those that are not moved their noise."),
			{}, false},
	};
	if (surface) {
		list.insert(list.begin(), {Parameter::BOOL, "visibleLayers", 0, "Merge all visible layers",
			"The surface is fitted to the vertices of all visible layers together, which are scans of one "
			"object in one frame.", {}, false});
		list.push_back({Parameter::BOOL, "moveLayers", 0, "Move merged layers together",
			"Whether each merged layer, a sweep of the same thing, is first moved and turned a little so that "
			"they lie on each other. The layers stay where they are.", {}, true});
		list.push_back({Parameter::FLOAT, "detail", o.detail, "Detail",
			"Fineness of the surface, 0.1 to 10: 1 = what the data supports, 0.5 = half as fine.", {},
			false});
		list.push_back({Parameter::LENGTH, "fillHoles", o.fill_holes, "Fill holes",
			"Holes with a boundary shorter than this are filled. 0 = only gaps of the sampling and places about which the points thin out.",
			{}, false});
		list.push_back({Parameter::FLOAT, "minPart", o.min_part, "Smallest part (share)",
			"Connected parts of the surface that have less than this share of its area, 0 to 1, are left out. "
			"0 = all stay.",
			{}, true});
		list.push_back({Parameter::BOOL, "largest", double(o.largest), "Largest part only",
			"Whether only the largest connected part of the surface is kept, by area.", {}, false});
		list.push_back({Parameter::INT, "faces", double(o.faces), "Triangles",
			"Triangles that the surface should have at the most. 0 = about as many as points.", {}, false});
		list.push_back({Parameter::LENGTH, "maxError", 0, "Largest error",
			"How far the surface may move to have fewer triangles. 0 = as far as Triangles asks for, without "
			"that a quarter of the noise or a twentieth of the spacing.",
			{}, true});
		list.push_back({Parameter::BOOL, "simplify", 1, "Fewer triangles where it is flat",
			"Off: all triangles that the surface is made with, four to ten times as many.", {}, true});
		list.push_back({Parameter::BOOL, "watertight", double(o.watertight), "Watertight",
			"Whether the surface is to be that of a solid, for printing: closed, without self-intersections.", {},
			false});
		list.push_back({Parameter::BOOL, "uv", double(o.uv), "Lay out UVs",
			"Whether the surface gets per-wedge texture coordinates.", {}, false});
		list.push_back(texture_size_parameter(o.texture_size));
		list.push_back(texture_parameter());
	} else {
		list.push_back({Parameter::BOOL, "selectOutliers", 0, "Select outliers",
			"Replaces the selection by the vertices that belong to no surface, ready to be deleted. In a mesh "
			"they were put between their neighbours, in a point cloud they stay where they are.",
			{}, false});
	}
	return list;
}

/// What the filters that put charts on pages have in common.
std::vector<Parameter> page_parameters()
{
	const atlasfit_unwrap_options o = defaults(atlasfit_unwrap_options_init);
	return {
		texture_size_parameter(o.page_width),
		texture_parameter(),
		{Parameter::INT, "padding", double(o.padding), "Padding (texels)",
			"Free texels between charts and at the page's border.", {}, true},
		{Parameter::INT, "pages", double(o.pages), "Most pages",
			"0 = one page, or with a density as many as that needs. Where a density needs more than these, it "
			"is lowered.", {}, true},
		{Parameter::FLOAT, "density", o.texels_per_unit, "Density (texels per unit)",
			"Texels per unit of length on the surface. 0 = what fills the pages.", {}, true},
		{Parameter::ENUM, "packer", double(o.packer), "Packing",
			"How charts are put on the page. <b>Shapes</b>: in each other's bays and holes. <b>Boxes</b>: by "
			"their bounding boxes, fastest.",
			{"Shapes", "Boxes"}, true},
	};
}

std::vector<Parameter> unwrap_parameters()
{
	const atlasfit_unwrap_options o = defaults(atlasfit_unwrap_options_init);
	std::vector<Parameter> list{
		{Parameter::ENUM, "preset", double(ATLASFIT_PRESET_BALANCED), "Preset",
			"What matters most; it stands for a bound on the stretch. <b>Few seams</b>: few charts and short "
			"seams, also for meshes of few faces. <b>Low stretch</b>: lengths are kept best, with most "
			"charts.",
			{"Few seams", "Balanced", "Low stretch"}, false}, // in the order of ATLASFIT_PRESET_...
		{Parameter::FLOAT, "maxStretch", 0, "Largest stretch",
			"Bound on the stretch of 95% of the area: 1.1 = lengths are kept within about 10%. Larger gives "
			"fewer charts. 0 = that of the preset.",
			{}, false},
		{Parameter::INT, "maxCharts", double(o.max_charts), "Most charts",
			"The stretch bound is raised as far as that needs. 0 = any number.", {}, false},
		{Parameter::BOOL, "keepSeams", double(o.keep_uv_seams), "Keep seams",
			"Seams of the texture coordinates that the mesh has stay seams.", {}, false},
		{Parameter::FLOAT, "hardEdges", o.hard_edge_angle, "Cut at angles above (degrees)",
			"Edges bent by more than this become seams, 0 to 180; 180 = none do for that reason.", {}, false},
	};
	for (const Parameter& p : page_parameters())
		list.push_back(p);
	list.push_back({Parameter::ENUM, "stack", double(o.stack), "Stack",
		"Parts of one shape share their texels, corner on corner. <b>Identical</b>: moved and turned copies. "
		"<b>Mirrored</b>: mirror images too.",
		{"None", "Identical", "Mirrored"}, true}); // in the order of ATLASFIT_STACK_...
	list.push_back({Parameter::FLOAT, "seamsHidden", o.seams_hidden, "Hide seams",
		"How much seams go where they are hardly seen from outside, 0 to 1. 0 = they are as short as can be.",
		{}, true});
	list.push_back({Parameter::BOOL, "seamPrice", 0, "Quality prices seams",
		"The quality of a vertex says what seams cost there: less where they may be, more where not. Paint it "
		"with the quality brush, or compute it.",
		{}, true});
	list.push_back({Parameter::BOOL, "straighten", double(o.straighten), "Straighten",
		"Strips, tubes, rims and long straight sides are laid along the page's sides, as far as the bound on the "
		"stretch allows it. Charts are then turned in quarter turns only, which may cost texels.",
		{}, true});
	return list;
}

} // namespace

const About& about(int filter)
{
	static const std::array<About, FILTERS> all{{
		{"Surface Reconstruction: Atlas", "generate_surface_reconstruction_atlas",
			QString("Surface of a noisy scan or point cloud: one clean connected surface in a new layer, with "
					"normals, colours and UVs. Noise, outliers and charts are found from the data; no normals are "
					"needed. Holes stay open unless you ask for them to be filled.") +
				FRAME + PAPER,
			Host::Remeshing | Host::PointSet, MeshModel::MM_NONE,
			MeshModel::MM_VERTNUMBER | MeshModel::MM_FACENUMBER},
		{"Denoise: Atlas", "apply_coord_denoising_atlas",
			QString("Removes noise, finds outliers: moves the vertices of a point cloud or a scanned mesh onto an "
					"atlas of smooth charts that is fitted to them. Order, faces, attributes and selection stay; "
					"how far each vertex was moved, or how sure it is, becomes its quality. Outliers follow "
					"their neighbours in a mesh, and stay where they are in a point cloud.") +
				FRAME + PAPER,
			Host::Smoothing | Host::PointSet, MeshModel::MM_NONE,
			MeshModel::MM_VERTCOORD | MeshModel::MM_VERTNORMAL | MeshModel::MM_FACENORMAL |
				MeshModel::MM_VERTQUALITY | MeshModel::MM_VERTFLAGSELECT},
		{"Parametrization: Atlas", "compute_texcoord_parametrization_atlas",
			QString("UV unwrap: gives the current mesh per-wedge texture coordinates (UVs): few charts of low "
					"stretch that neither flip nor overlap, packed on square pages. Textures that the layer has "
					"are drawn anew at no lower density, else vertex colours are baked. Geometry and order stay. "
					"Any mesh will do: open, closed, of any genus, with non-manifold edges.") +
				FRAME + PAPER + STRETCH_PAPER,
			Host::Texture, MeshModel::MM_FACENUMBER, MeshModel::MM_WEDGTEXCOORD | MeshModel::MM_FACENUMBER},
		{"Parametrization: Pack Charts", "compute_texcoord_packing_atlas",
			QString("UV packing: the charts of the per-wedge texture coordinates (UVs) that the current mesh has "
					"are moved, turned and scaled to one density, and packed on square pages by their shapes. "
					"They stay as they are otherwise; what flips or overlaps in a chart is cut. Charts of "
					"several pages come together. Textures that the layer has are drawn anew at no lower "
					"density.") +
				FRAME,
			Host::Texture, MeshModel::MM_FACENUMBER | MeshModel::MM_WEDGTEXCOORD,
			MeshModel::MM_WEDGTEXCOORD | MeshModel::MM_FACENUMBER},
		{"UV Distortion", "compute_scalar_by_uv_distortion_per_face",
			QString("Quality of a parametrization: measures the per-wedge texture coordinates (UVs) of the current "
					"mesh, whoever made them. Face quality becomes the stretch: the largest factor by which a "
					"length on the face is stretched or shrunk in the texture, after one global scale that makes "
					"the areas equal; 1 = isometric. Collapsed faces get the largest stretch of the others. The "
					"log says charts, seam length, stretch, flips and overlaps. Pages count as square.") +
				FRAME + STRETCH_PAPER,
			Host::Quality | Host::Texture, MeshModel::MM_FACENUMBER | MeshModel::MM_WEDGTEXCOORD,
			MeshModel::MM_FACEQUALITY | MeshModel::MM_FACECOLOR},
	}};
	return all.at(std::size_t(filter));
}

std::vector<Parameter> parameters(int filter)
{
	std::vector<Parameter> list;
	switch (filter) {
	case RECONSTRUCT: list = denoise_parameters(true); break;
	case DENOISE: list = denoise_parameters(false); break;
	case PARAMETRIZE: list = unwrap_parameters(); break;
	case PACK: list = page_parameters(); break;
	case DISTORTION:
		list = {{Parameter::BOOL, "colorize", 1, "Colorize",
			"Faces are coloured by their stretch, from blue (none) to red (1.5 and more).", {}, false}};
		break;
	}
	for (const Parameter& p : run_parameters())
		list.push_back(p);
	for (Parameter& p : list) {
		const QString value = p.kind == Parameter::BOOL ? QString(p.value != 0 ? "on" : "off")
			: p.kind == Parameter::ENUM ? p.choices.value(int(p.value)) : QString::number(p.value);
		p.help += "<br>Default: " + value + ".";
	}
	return list;
}
