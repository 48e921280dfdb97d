// SPDX-License-Identifier: GPL-3.0-or-later
#include "page.h"

#include <cstdint>

QImage checker(int size)
{
	const int squares = 32;
	QImage image(size, size, QImage::Format_RGB32);
	for (int y = 0; y < size; ++y) {
		QRgb* row = reinterpret_cast<QRgb*>(image.scanLine(y));
		for (int x = 0; x < size; ++x)
			row[x] = (int(int64_t(x) * squares / size) + int(int64_t(y) * squares / size)) % 2
				? qRgb(235, 235, 235)
				: qRgb(90, 120, 160);
	}
	return image;
}

void check_page(const RichParameterList& par)
{
	const double size = count(par, "textureSize");
	if (par.getEnum("texture") != TEXTURE_NONE && size * size * 4 > 2147483647.0)
		throw std::runtime_error("atlasfit: a texture page of " + std::to_string(int(size)) +
			" texels is more than MeshLab can hold. Make it smaller, or choose no page");
}

OldTextures::OldTextures(const MeshModel& layer, const Triangles& triangles, Outcome& outcome)
{
	if (!layer.hasDataMask(MeshModel::MM_WEDGTEXCOORD) || layer.cm.textures.empty())
		return;
	std::vector<uint32_t> place;
	for (const std::string& name : layer.cm.textures) {
		const QImage page = page_of(layer, name);
		place.push_back(page.isNull() ? UINT32_MAX : uint32_t(pages.size()));
		if (page.isNull())
			outcome.lines.push_back("warning: the texture " + name + " cannot be read: it is not drawn anew");
		else
			pages.push_back(page.convertToFormat(QImage::Format_RGBA8888));
	}
	if (pages.empty())
		return;
	for (const QImage& page : pages) {
		atlasfit_image image = defaults(atlasfit_image_init);
		image.rgba = page.constBits(); // rows of 4 bytes a pixel have no gap
		image.width = uint32_t(page.width());
		image.height = uint32_t(page.height());
		images.push_back(image);
	}
	uv = corner_uv(layer.cm, triangles);
	for (uint32_t page : face_pages(layer.cm, triangles))
		face_image.push_back(page < place.size() ? place[page] : UINT32_MAX);
}

atlasfit_textures OldTextures::c() const
{
	atlasfit_textures out = defaults(atlasfit_textures_init);
	out.images = images.data();
	out.image_count = images.size();
	out.corner_uv = uv.data();
	out.face_image = face_image.data();
	return out;
}

std::vector<QImage> page_images(const RichParameterList& par, int size, std::size_t pages,
	const atlasfit_mesh& mesh, Sources from, Bar& bar, Outcome& outcome)
{
	const int texture = par.getEnum("texture");
	if (texture == TEXTURE_NONE)
		return {};
	if (texture == TEXTURE_CHECKER)
		return std::vector<QImage>(pages, checker(size));
	if (!from.textures && (from.scan ? from.scan->colors : mesh.colors) == nullptr)
		return {};
	atlasfit_bake_options options = defaults(atlasfit_bake_options_init);
	options.width = options.height = uint32_t(size);
	options.textures = from.textures;
	const atlasfit_points* scan = from.textures ? nullptr : from.scan;
	const atlasfit_run how = run(par, &bar);
	std::vector<QImage> images;
	for (; options.page < pages; ++options.page) {
		const double share = (1 - LAID_OUT) / double(pages), begin = LAID_OUT + share * options.page;
		bar.part(begin, begin + share);
		QImage image(size, size, QImage::Format_RGBA8888);
		timed(outcome, [&] {
			return atlasfit_bake(&mesh, scan, &options, &how, image.bits(), std::size_t(image.sizeInBytes()));
		});
		images.push_back(image.convertToFormat(QImage::Format_RGB32));
	}
	return images;
}
