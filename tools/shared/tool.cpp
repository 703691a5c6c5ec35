// SPDX-License-Identifier: Apache-2.0
#include "tools/shared/tool.h"

#include <exception>
#include <iostream>
#include <new>
#include <optional>
#include <system_error>
#include <thread>

#include <fmt/format.h>
#include <openvdb/openvdb.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <unistd.h>

#include "volcomp/base/atomic_file.h"
#include "volcomp/base/clock.h"
#include "volcomp/base/parallel.h"
#include "volcomp/scene/scene.h"
#include "tools/shared/numbers.h"
#include "tools/shared/version.h"

namespace volcomp {
namespace {

double peakMegabytes()
{
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return double(usage.ru_maxrss) / 1024;
}

constexpr const char* kNoMemory =
    "the memory of this machine is not enough; a larger voxel needs less";

std::string noThreads(const std::string& why)
{
    return "the system gives no more threads or memory (" + why + "); fewer --threads need less";
}

/// What to say of the exception that is being handled.
std::string currentMessage()
{
    try {
        throw;
    } catch (const std::bad_alloc&) {
        return kNoMemory;
    } catch (const std::system_error& e) {
        if (e.code() == std::errc::resource_unavailable_try_again
            || e.code() == std::errc::not_enough_memory)
            return noThreads(e.what());
        return e.what();
    } catch (const std::exception& e) { // TBB's, and what libraries make of those above
        const std::string text = e.what();
        if (text.find("bad_alloc") != std::string::npos) return kNoMemory;
        return text.find("pthread_create") == std::string::npos ? text : noThreads(text);
    } catch (...) {
        return "an unknown exception";
    }
}

/// Ends the program after an exception that nothing catches, such as one in a library's thread.
[[noreturn]] void endWithMessage()
{
    if (std::current_exception()) {
        try {
            spdlog::error("{}", currentMessage());
        } catch (...) { // not even the memory for the message
        }
        _exit(1);
    }
    std::abort(); // a bug
}

/// Returns the exit status after something was printed: 1, and says so, if stdout did not take it.
int statusOfStdout()
{
    if (std::cout.flush()) return 0;
    spdlog::error("the output could not be written to stdout");
    return 1;
}

} // namespace

Tool::Tool(const std::string& name, const std::string& description)
    : app(description, name), m_name(name)
{
    app.set_version_flag("--version", versionText(name));
    app.add_flag("-q,--quiet", m_quiet, "Say nothing but warnings and errors");
    app.add_option("--threads", m_threads, "Threads to use; 0: one for each core")
        ->capture_default_str()
        ->check(wholeNumber(0, 4096));
    app.add_option("--stats", m_stats,
                   "Write seconds, memory, sizes and settings to this file (JSON)")
        ->type_name("FILE");
    addPrint("--scene-keys", "Print every key of the scene file (Markdown), and exit",
             [] { return keysAsMarkdown(sceneKeys()); });
    app.get_formatter()->column_width(34);
}

void Tool::addPrint(const std::string& flag, const std::string& meaning,
                    std::function<std::string()> text)
{
    app.add_flag(flag, meaning);
    m_prints.emplace_back(flag, std::move(text));
}

int Tool::main(int argc, char** argv, const std::function<void()>& run)
{
    spdlog::set_default_logger(spdlog::stderr_color_mt(m_name));
    spdlog::set_pattern("%n: %^%v%$");
    std::set_terminate(endWithMessage);
    for (int i = 1; i < argc; ++i)
        for (const auto& [flag, text] : m_prints)
            if (argv[i] == flag) {
                std::cout << text();
                return statusOfStdout();
            }
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& e) {
        return app.exit(e) == 0 ? statusOfStdout() : 2;
    }
    if (m_quiet) spdlog::set_level(spdlog::level::warn);
    try {
        const ThreadLimit limit(m_threads);
        openvdb::initialize();
        const double wall = wallSeconds(), cpu = cpuSeconds();
        stats["program"] = m_name;
        stats["version"] = VOLCOMP_VERSION;
        stats["threads"] =
            m_threads > 0 ? m_threads : static_cast<int>(std::thread::hardware_concurrency());
        run();
        stats["total"] = {{"wall_seconds", wallSeconds() - wall},
                          {"cpu_seconds", cpuSeconds() - cpu}};
        stats["peak_memory_mb"] = peakMegabytes();
        say(fmt::format("done in {:.2f} s, {:.0f} MB at the peak", wallSeconds() - wall,
                        peakMegabytes()));
        if (!m_stats.empty()) writeTextAtomically(m_stats, stats.dump(2) + '\n');
        return 0;
    } catch (const std::exception&) {
        spdlog::error("{}", currentMessage());
    }
    return 1;
}

void Tool::requireFiles(const std::vector<NamedFile>& inputs, std::vector<NamedFile> outputs) const
{
    if (!m_stats.empty()) outputs.push_back({"--stats", m_stats});
    requireDistinct(inputs, outputs);
    for (const NamedFile& output : outputs)
        if (!output.file.empty()) requireWritable(output.file);
}

void Tool::say(const std::string& message) const { spdlog::info("{}", message); }
void Tool::warn(const std::string& message) const { spdlog::warn("{}", message); }

Tool::Stage::Stage(Tool& tool, const std::string& name)
    : m_tool(tool), m_name(name), m_wall(wallSeconds()), m_cpu(cpuSeconds()),
      m_exceptions(std::uncaught_exceptions())
{
    m_shown = m_wall;
}

Tool::Stage::~Stage()
{
    const bool terminal = isatty(STDERR_FILENO) && !m_tool.m_quiet;
    if (terminal) std::cerr << "\r\033[K" << std::flush;
    if (std::uncaught_exceptions() > m_exceptions) return;
    const double wall = wallSeconds() - m_wall, cpu = cpuSeconds() - m_cpu;
    m_tool.stats["stages"].push_back(
        {{"name", m_name}, {"wall_seconds", wall}, {"cpu_seconds", cpu}});
    m_tool.say(fmt::format("{}: {:.2f} s", m_name, wall));
}

Progress Tool::Stage::progress()
{
    if (m_tool.m_quiet) return {};
    const bool terminal = isatty(STDERR_FILENO);
    return [this, terminal](double fraction) {
        const double now = wallSeconds();
        if (terminal) {
            if (now - m_shown < 0.1) return;
            m_shown = now;
            const int full = static_cast<int>(30 * fraction);
            std::cerr << fmt::format(
                "\r\033[K{} [{}{}] {:3.0f} %{}", m_name, std::string(full, '#'),
                std::string(30 - full, '.'), 100 * fraction,
                fraction > 0 && now - m_wall > 1 ? ", " + paceText(fraction, now - m_wall) : "")
                      << std::flush;
        } else if (const auto line = m_lines.next(fraction, now - m_wall)) {
            m_tool.say(m_name + ": " + *line);
        }
    };
}

} // namespace volcomp
