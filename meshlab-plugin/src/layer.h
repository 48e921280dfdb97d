// SPDX-License-Identifier: GPL-3.0-or-later
// A layer as plain arrays and back. Deleted elements are left out; positions are those that the user sees,
// the layer's matrix applied.
#pragma once

#include "host.h"

#include <cstdint>

/// The layer's frame and the one that the user sees.
struct Frame {
	explicit Frame(const CMeshO& layer);
	/// Whether the layer's matrix is anything but the identity.
	bool moved;
	/// From the layer's frame to the shown one, and back.
	vcg::Matrix44d to, back;
	/// The same for directions that stand on the surface.
	vcg::Point3<Coordinate> normal_back(const float* n) const;
	vcg::Point3<Coordinate> position_back(const double* p) const;
};

/// Points of a layer.
struct Points {
	/// x, y, z of each.
	std::vector<double> xyz;
	/// Its vertex in the layer.
	std::vector<uint32_t> vertex;
};

/// Triangles of a layer.
struct Triangles {
	/// Three places in Points for each.
	std::vector<uint32_t> corners;
	/// Its face in the layer.
	std::vector<uint32_t> face;
};

Points points(const CMeshO& layer, const Frame& frame, bool only_selected);
Triangles triangles(const CMeshO& layer, const Points& points);

/// u, v of each triangle's corners as they are in the layer.
std::vector<float> corner_uv(const CMeshO& layer, const Triangles& triangles);

/// The page of each triangle's UVs.
std::vector<uint32_t> face_pages(const CMeshO& layer, const Triangles& triangles);

/// For each triangle the polygon that it is part of, by the edges that the host hides. Empty where no edge is
/// hidden.
std::vector<uint32_t> polygons(const CMeshO& layer, const Triangles& triangles);

/// Red, green, blue, alpha of each point.
std::vector<uint8_t> colors(const CMeshO& layer, const Points& points);

/// Whether these colours show anything: hosts give each vertex a colour, the same for all, where a file has
/// none.
bool are_painted(const std::vector<uint8_t>& rgba);

/// Sets the corners' UVs and pages; `pages` has one number per triangle or is empty (one page).
void set_corner_uv(MeshModel& layer, const Triangles& triangles, const std::vector<float>& uv,
	const std::vector<uint32_t>& pages);
