// SPDX-License-Identifier: GPL-3.0-or-later
// Pictures for texture pages.
#pragma once

#include <QImage>
#include <cstdint>
#include <vector>

/// A square page of plain grey.
QImage plain(int size);

/// A square checkerboard: squares on the surface are as large and as square everywhere as the UVs are good.
QImage checker(int size);

/// Square pages with colours of vertices on their triangles, carried on for `padding` texels beyond the charts' borders so that filtering stays clean.
///
/// `corners` are three vertices per triangle, `uv` six numbers per triangle, v up, `page` one number per triangle (empty: one page), `rgba` four
/// numbers per vertex.
std::vector<QImage> bake(int size, int padding, std::size_t pages, const std::vector<uint32_t>& corners, const std::vector<float>& uv,
	const std::vector<uint32_t>& page, const std::vector<uint8_t>& rgba);
