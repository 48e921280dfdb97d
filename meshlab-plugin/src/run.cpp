// SPDX-License-Identifier: GPL-3.0-or-later
#include "run.h"

#include <cstdio>
#include <cstdlib>

/// Seconds. The GUI cannot cancel, so that a run must end by itself; far above what millions of points take.
static const double TIME_LIMIT = 600;

void check(atlasfit_status status)
{
	if (status == ATLASFIT_OK)
		return;
	std::string text(atlasfit_last_error(nullptr, 0) + 1, '\0');
	text.resize(atlasfit_last_error(&text[0], text.size()));
	throw std::runtime_error(
		"atlasfit: " + (text.empty() ? std::string(atlasfit_status_name(status)) : text));
}

std::string time_left(double seconds, double share)
{
	// Earlier it would be a guess.
	if (seconds < 1 || share < 0.02 || share >= 1)
		return "";
	const double left = seconds * (1 - share) / share;
	return left < 90 ? ", " + std::to_string(int(left + 0.5)) + " s left"
					 : ", " + std::to_string(int(left / 60 + 0.5)) + " min left";
}

bool Bar::show(const char* stage)
{
	const double share = from + (to - from) * overall;
	const double seconds =
		std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
	return host(int(100 * share), (stage + time_left(seconds, share)).c_str());
}

static int32_t relay(void* user, uint32_t stage, double)
{
	// The host's callback may not throw through the library.
	try {
		return static_cast<Bar*>(user)->show(atlasfit_stage_name(stage)) ? 1 : 0;
	} catch (...) {
		return 0;
	}
}

std::vector<Parameter> run_parameters()
{
	const atlasfit_run run = defaults(atlasfit_run_init);
	return {
		{Parameter::FLOAT, "timeLimit", TIME_LIMIT, "Time limit (s)",
			"Seconds after which the filter gives up and changes nothing: MeshLab has no way to cancel a "
			"filter. 0 = no limit.",
			{}, true},
		{Parameter::INT, "memoryLimit", double(run.memory_limit_bytes), "Memory limit (MiB)",
			"The filter gives up at once where it expects to need more. 0 = no limit.", {}, true},
		{Parameter::INT, "seed", double(run.seed), "Seed",
			"Seed of everything random. Same input and seed give the same result.", {}, true},
		{Parameter::INT, "threads", double(run.threads), "Threads",
			"Worker threads; 0 = all cores. The result does not depend on it.", {}, true},
	};
}

atlasfit_run run(const RichParameterList& par, Bar* bar)
{
	atlasfit_run run = defaults(atlasfit_run_init);
	run.time_limit_s = number(par, "timeLimit");
	run.memory_limit_bytes = uint64_t(count(par, "memoryLimit")) << 20;
	run.seed = count(par, "seed");
	run.threads = count(par, "threads");
	if (bar && bar->host) {
		run.progress = relay;
		run.progress_user = bar;
		run.overall = &bar->overall;
	}
	return run;
}

static double decimal(Coordinate value)
{
	if (DOUBLE_HOST)
		return double(value);
	char text[32];
	std::snprintf(text, sizeof text, "%.7g", double(value));
	return std::strtod(text, nullptr);
}

double number(const RichParameterList& par, const char* name)
{
	return decimal(Coordinate(par.getFloat(name)));
}

double length(const RichParameterList& par, const char* name)
{
	return decimal(Coordinate(par.getAbsPerc(name)));
}

uint32_t count(const RichParameterList& par, const char* name)
{
	const int value = par.getInt(name);
	if (value < 0)
		throw std::runtime_error(
			std::string("atlasfit: ") + name + " is " + std::to_string(value) + ". Give 0 or more");
	return uint32_t(value);
}
