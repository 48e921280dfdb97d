// SPDX-License-Identifier: GPL-3.0-or-later
// Calls into libatlasfit: its failures as exceptions, its handles freed, its progress on the host's bar, its
// struct defaults.
#pragma once

#include "filters.h"

#include <atlasfit.h>
#include <chrono>
#include <memory>

/// Throws what the library says of a failure.
void check(atlasfit_status status);

/// One long call into the library, its time added up.
template <class Call> void timed(Outcome& outcome, Call call)
{
	const auto started = std::chrono::steady_clock::now();
	const atlasfit_status status = call();
	outcome.library_seconds +=
		std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
	check(status);
}

/// A struct with the library's defaults.
template <class T> T defaults(atlasfit_status (*init)(T*, std::size_t))
{
	T value;
	check(init(&value, sizeof value));
	return value;
}

/// A struct that the library fills.
template <class T> T out()
{
	T value{};
	value.struct_size = sizeof value;
	return value;
}

/// Frees what the library made.
struct Free {
	void operator()(atlasfit_result* result) const { atlasfit_result_free(result); }
	void operator()(atlasfit_uv* uv) const { atlasfit_uv_free(uv); }
};
using Result = std::unique_ptr<atlasfit_result, Free>;
using Uv = std::unique_ptr<atlasfit_uv, Free>;

/// ", 12 s left" after so many seconds, when this share is done; nothing where it would be a guess.
std::string time_left(double seconds, double share);

/// The host's bar, filled once over all calls of a filter: it never falls.
class Bar {
public:
	/// `host` may be null.
	explicit Bar(vcg::CallBackPos* host) : host(host) {}
	Bar(const Bar&) = delete;
	Bar& operator=(const Bar&) = delete;
	/// What the calls to come cover, in [0, 1].
	void part(double begin, double end)
	{
		from = begin;
		to = end;
	}
	vcg::CallBackPos* const host;
	/// Shows what is done of all, the running stage, and the time that is left. False where the host stops.
	bool show(const char* stage);
	/// Of the call: written by the library.
	double overall = 0;
	double from = 0, to = 1;

private:
	const std::chrono::steady_clock::time_point started = std::chrono::steady_clock::now();
};

/// The parameters that every filter ends with.
std::vector<Parameter> run_parameters();

/// How a call is run, from those parameters. The bar, if there is one, must outlive the call.
atlasfit_run run(const RichParameterList& par, Bar* bar);

/// A number that the user gave. Hosts built for float hold 1.1 as 1.10000002: its shortest decimal is what
/// was meant.
double number(const RichParameterList& par, const char* name);

/// A length that the user gave, in the layer's unit or as a share of its diagonal.
double length(const RichParameterList& par, const char* name);

/// A whole number that the user gave, 0 or more.
uint32_t count(const RichParameterList& par, const char* name);
