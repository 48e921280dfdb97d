// SPDX-License-Identifier: GPL-3.0-or-later
#include "page.h"

#include <algorithm>
#include <array>
#include <cmath>

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
			row[x] = (int(int64_t(x) * squares / size) + int(int64_t(y) * squares / size)) % 2 ? qRgb(235, 235, 235) : qRgb(90, 120, 160);
	}
	return image;
}

/// Colours the texels whose centres lie in a triangle, given by its corners in texels, and marks them.
static void fill(QImage& image, std::vector<uint8_t>& done, const std::array<double, 6>& p, const std::array<const uint8_t*, 3>& rgba)
{
	const int size = image.width();
	const double area = (p[2] - p[0]) * (p[5] - p[1]) - (p[4] - p[0]) * (p[3] - p[1]);
	if (area == 0 || !std::isfinite(area))
		return;
	const auto low = [&](int k) { return std::max(0, int(std::floor(std::min({p[k], p[k + 2], p[k + 4]})))); };
	const auto high = [&](int k) { return std::min(size - 1, int(std::ceil(std::max({p[k], p[k + 2], p[k + 4]})))); };
	for (int y = low(1); y <= high(1); ++y) {
		QRgb* row = reinterpret_cast<QRgb*>(image.scanLine(y));
		for (int x = low(0); x <= high(0); ++x) {
			const double cx = x + 0.5, cy = y + 0.5;
			const double a = ((p[2] - cx) * (p[5] - cy) - (p[4] - cx) * (p[3] - cy)) / area;
			const double b = ((p[4] - cx) * (p[1] - cy) - (p[0] - cx) * (p[5] - cy)) / area;
			const double c = 1 - a - b;
			if (a < 0 || b < 0 || c < 0)
				continue;
			const auto mix = [&](int k) { return int(a * rgba[0][k] + b * rgba[1][k] + c * rgba[2][k] + 0.5); };
			row[x] = qRgb(mix(0), mix(1), mix(2));
			done[std::size_t(y) * std::size_t(size) + std::size_t(x)] = 1;
		}
	}
}

/// Carries colours on by one texel into texels that have none: the mean of the neighbours that have one. `border` are the marked texels to start from; what is
/// new takes their place.
static void grow(QImage& image, std::vector<uint8_t>& done, std::vector<uint32_t>& border)
{
	const int size = image.width();
	QRgb* texels = reinterpret_cast<QRgb*>(image.bits());
	std::vector<uint32_t> next;
	for (const uint32_t at : border)
		for (int k = 0; k < 9; ++k) {
			const int x = int(at % uint32_t(size)) + k % 3 - 1, y = int(at / uint32_t(size)) + k / 3 - 1;
			if (x >= 0 && y >= 0 && x < size && y < size && !done[std::size_t(y) * std::size_t(size) + std::size_t(x)])
				next.push_back(uint32_t(y) * uint32_t(size) + uint32_t(x));
		}
	std::sort(next.begin(), next.end());
	next.erase(std::unique(next.begin(), next.end()), next.end());
	for (const uint32_t at : next) {
		int sum[4] = {0, 0, 0, 0};
		for (int k = 0; k < 9; ++k) {
			const int x = int(at % uint32_t(size)) + k % 3 - 1, y = int(at / uint32_t(size)) + k / 3 - 1;
			const std::size_t i = std::size_t(y) * std::size_t(size) + std::size_t(x);
			if (x >= 0 && y >= 0 && x < size && y < size && done[i] == 1) {
				const QRgb c = texels[i];
				sum[0] += qRed(c), sum[1] += qGreen(c), sum[2] += qBlue(c), sum[3] += 1;
			}
		}
		texels[at] = qRgb(sum[0] / sum[3], sum[1] / sum[3], sum[2] / sum[3]);
	}
	for (const uint32_t at : next)
		done[at] = 1;
	border = std::move(next);
}

std::vector<QImage> bake(int size, int padding, std::size_t pages, const std::vector<uint32_t>& corners, const std::vector<float>& uv,
	const std::vector<uint32_t>& page, const std::vector<uint8_t>& rgba)
{
	std::vector<QImage> images;
	for (std::size_t n = 0; n < pages; ++n) {
		images.push_back(plain(size));
		std::vector<uint8_t> done(std::size_t(size) * std::size_t(size), 0);
		for (std::size_t i = 0; i < corners.size() / 3; ++i) {
			if ((page.empty() ? 0 : page[i]) != n)
				continue;
			std::array<double, 6> p;
			std::array<const uint8_t*, 3> color;
			for (std::size_t k = 0; k < 3; ++k) {
				p[2 * k] = double(uv[6 * i + 2 * k]) * size;
				p[2 * k + 1] = (1 - double(uv[6 * i + 2 * k + 1])) * size;
				color[k] = &rgba[4 * corners[3 * i + k]];
			}
			fill(images[n], done, p, color);
		}
		std::vector<uint32_t> border;
		for (std::size_t i = 0; i < done.size(); ++i)
			if (done[i])
				border.push_back(uint32_t(i));
		for (int k = 0; k < padding && !border.empty(); ++k)
			grow(images[n], done, border);
	}
	return images;
}
