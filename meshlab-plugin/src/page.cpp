// SPDX-License-Identifier: GPL-3.0-or-later
#include "page.h"

#include <cstdint>

static const QRgb GREY = qRgb(200, 200, 200);

QImage plain(int size)
{
	QImage image(size, size, QImage::Format_RGB32);
	image.fill(GREY);
	return image;
}

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

std::vector<QImage> page_images(const RichParameterList& par, std::size_t pages, const atlasfit_mesh& mesh,
	const atlasfit_points* scan, Bar& bar, Outcome& outcome)
{
	const int texture = par.getEnum("texture"), size = int(count(par, "textureSize"));
	if (texture == TEXTURE_NONE)
		return {};
	if (texture == TEXTURE_CHECKER)
		return std::vector<QImage>(pages, checker(size));
	if ((scan ? scan->colors : mesh.colors) == nullptr)
		return std::vector<QImage>(pages, plain(size));
	atlasfit_bake_options options = defaults(atlasfit_bake_options_init);
	options.width = options.height = uint32_t(size);
	const atlasfit_run how = run(par, &bar);
	std::vector<QImage> images;
	for (; options.page < pages; ++options.page) {
		const double share = (1 - LAID_OUT) / double(pages), from = LAID_OUT + share * options.page;
		bar.part(from, from + share);
		QImage image(size, size, QImage::Format_RGBA8888);
		timed(outcome, [&] {
			return atlasfit_bake(&mesh, scan, &options, &how, image.bits(), std::size_t(image.sizeInBytes()));
		});
		images.push_back(image.convertToFormat(QImage::Format_RGB32));
	}
	return images;
}
