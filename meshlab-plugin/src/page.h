// SPDX-License-Identifier: GPL-3.0-or-later
// Pictures for texture pages.
#pragma once

#include <QImage>

/// A square page of plain grey.
QImage plain(int size);

/// A square checkerboard: squares on the surface are as large and as square everywhere as the UVs are good.
QImage checker(int size);
