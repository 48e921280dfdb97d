// SPDX-License-Identifier: GPL-3.0-or-later
// Pictures for texture pages.
#pragma once

#include "run.h"

#include <QImage>

/// A square page of plain grey.
QImage plain(int size);

/// A square checkerboard: squares on the surface are as large and as square everywhere as the UVs are good.
QImage checker(int size);

/// Refuses, before any work, a page that the host's pictures (below 2 GiB) cannot hold.
void check_page(const RichParameterList& par);

/// Share of the host's bar that is full when the pages are baked, where they are.
constexpr double LAID_OUT = 0.9;

/// The pages that the user asked for: with the colours of `scan`, or of the mesh's own vertices. Made before
/// the document is touched: they may need more memory than there is.
std::vector<QImage> page_images(const RichParameterList& par, std::size_t pages, const atlasfit_mesh& mesh,
	const atlasfit_points* scan, Bar& bar, Outcome& outcome);
