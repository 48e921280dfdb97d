// SPDX-License-Identifier: GPL-3.0-or-later
// Pictures for texture pages.
#pragma once

#include "layer.h"
#include "run.h"

#include <QImage>

/// A square checkerboard: squares on the surface are as large and as square everywhere as the UVs are good.
QImage checker(int size);

/// Refuses, before any work, a page that the host's pictures (below 2 GiB) cannot hold.
void check_page(const RichParameterList& par);

/// Share of the host's bar that is full when the pages are baked, where they are.
constexpr double LAID_OUT = 0.9;

/// Textures that a layer has, as the library takes them.
struct OldTextures {
	OldTextures() = default;
	/// Those of a layer with UVs; none of one without, or where no page can be read. What is missing is noted.
	OldTextures(const MeshModel& layer, const Triangles& triangles, Outcome& outcome);
	bool empty() const { return images.empty(); }
	/// Borrows the arrays.
	atlasfit_textures c() const;
	std::vector<QImage> pages;
	std::vector<atlasfit_image> images;
	std::vector<float> uv;
	std::vector<uint32_t> face_image;
};

/// What a page's colours are taken from: old textures, else a scan, else the mesh's own vertices.
struct Sources {
	const atlasfit_textures* textures;
	const atlasfit_points* scan;
};

/// The pages that the user asked for, `size` texels wide; none where there are no colours. Made before the
/// document is touched: they may need more memory than there is.
std::vector<QImage> page_images(const RichParameterList& par, int size, std::size_t pages,
	const atlasfit_mesh& mesh, Sources from, Bar& bar, Outcome& outcome);
