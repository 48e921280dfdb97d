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
