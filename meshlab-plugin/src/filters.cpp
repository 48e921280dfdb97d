// SPDX-License-Identifier: GPL-3.0-or-later
// Applying a filter.
#include "shared.h"

Outcome apply(int filter, const RichParameterList& par, MeshDocument& md, vcg::CallBackPos* progress)
{
	// While the major version is 0, the minor one decides.
	if (atlasfit_version() >> 16 != ATLASFIT_VERSION >> 16)
		throw std::runtime_error("atlasfit: the plugin was built for another version of libatlasfit than the "
								 "one that was loaded. Build it again");
	Outcome outcome;
	Bar bar(progress);
	switch (filter) {
	case RECONSTRUCT: reconstruct(md, par, bar, outcome); break;
	case DENOISE: denoise_vertices(md, par, bar, outcome); break;
	case PARAMETRIZE: parametrize(md, par, bar, outcome); break;
	case PACK: pack(md, par, bar, outcome); break;
	case DISTORTION: distortion(md, par, bar, outcome); break;
	default: throw std::runtime_error("atlasfit: no such filter");
	}
	outcome.lines.push_back("libatlasfit took " + brief(outcome.library_seconds) + " s");
	outcome.values.push_back({"library_seconds", outcome.library_seconds});
	if (progress)
		progress(100, "done");
	return outcome;
}
