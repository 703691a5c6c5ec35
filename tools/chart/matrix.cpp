// SPDX-License-Identifier: Apache-2.0
#include "tools/chart/matrix.h"

#include <utility>

#include <fmt/format.h>

namespace volcomp {

std::vector<Row> radianceRows()
{
    std::vector<Row> rows;
    const auto add = [&](const std::string& name, const std::string& family,
                         std::function<void(RenderParams&)> change) {
        rows.push_back({name, family, std::move(change)});
    };
    for (const int samples : {1, 4, 16})
        add(fmt::format("sweep, {}", samples), kOwnLightFamily,
            [=](RenderParams& p) { p.samples = samples; });
    for (const int samples : {1, 4, 16})
        add(fmt::format("rays, {}", samples), "box, shadow rays",
            [=](RenderParams& p) { p.samples = samples, p.shadows = Shadows::exact; });
    for (const int samples : {1, 4, 16})
        add(fmt::format("trilinear, {}", samples), "trilinear, shadow rays", [=](RenderParams& p) {
            p.samples = samples, p.shadows = Shadows::exact, p.filter = Filter::trilinear;
        });
    for (const int samples : {1, 4, 16})
        add(fmt::format("trilinear sweep, {}", samples), "trilinear, sweep",
            [=](RenderParams& p) { p.samples = samples, p.filter = Filter::trilinear; });
    for (const double step : {2.0, 1.0, 0.5})
        add(fmt::format("riemann, step {:g}, 4", step), "riemann, shadow rays",
            [=](RenderParams& p) {
                p.integration = Integration::riemann, p.step = step, p.shadows = Shadows::exact;
            });
    for (const double cutoff : {0.1, 0.01, 0.0}) {
        add(fmt::format("sweep, cutoff {:g}, 4", cutoff), "other cutoff",
            [=](RenderParams& p) { p.cutoff = cutoff; });
        add(fmt::format("trilinear, cutoff {:g}, 4", cutoff), "other cutoff", [=](RenderParams& p) {
            p.cutoff = cutoff, p.shadows = Shadows::exact, p.filter = Filter::trilinear;
        });
    }
    add("no shadows, 4", "left out", [](RenderParams& p) { p.shadows = Shadows::none; });
    add("isotropic, 4", "left out", [](RenderParams& p) { p.extinction = Extinction::isotropic; });
    return rows;
}

std::vector<Row> otherLightRows(const std::string& light)
{
    std::vector<Row> rows;
    for (const int samples : {1, 4, 16})
        rows.push_back({fmt::format("{}, {}", light, samples), light + ", against the same light",
                        [=](RenderParams& p) { p.samples = samples; }});
    return rows;
}

RenderParams radianceReference(RenderParams p, int samples)
{
    p.filter = Filter::trilinear;
    p.shadows = Shadows::exact;
    p.cutoff = 1e-6;
    p.samples = samples;
    return p;
}

std::vector<TruthRow> truthRows(const std::vector<double>& factors, bool all_methods)
{
    std::vector<TruthRow> rows;
    for (const double factor : factors)
        for (const Filter filter : {Filter::box, Filter::trilinear})
            for (const Shadows shadows : {Shadows::sweep, Shadows::exact}) {
                const bool first = filter == Filter::box && shadows == Shadows::sweep;
                if (!first && factor != 1 && !all_methods) continue;
                const bool dearest = filter == Filter::trilinear && shadows == Shadows::exact;
                for (const int samples : {1, 4, 16})
                    if (samples == 4 || !dearest || all_methods)
                        rows.push_back({factor, filter, shadows, samples});
            }
    return rows;
}

std::vector<Row> transmittanceRows()
{
    std::vector<Row> rows{
        {"exact, box", "exact", [](RenderParams&) {}},
        {"exact, trilinear", "exact", [](RenderParams& p) { p.filter = Filter::trilinear; }}};
    for (const double step : {2.0, 1.0, 0.5, 0.25})
        rows.push_back({fmt::format("{:g}", step), "riemann, box", [=](RenderParams& p) {
                            p.integration = Integration::riemann, p.step = step;
                        }});
    for (const double step : {2.0, 1.0, 0.5, 0.25, 0.125})
        rows.push_back({fmt::format("{:g}", step), "riemann, trilinear", [=](RenderParams& p) {
                            p.integration = Integration::riemann, p.filter = Filter::trilinear,
                            p.step = step;
                        }});
    return rows;
}

} // namespace volcomp
