#include "app/options.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>

#include "app/job_file.hpp"
#include "app/suggest.hpp"
#include "app/value.hpp"
#include "knap/error.hpp"

namespace knap::app {

namespace {

std::string type_name(const Parameter& parameter) {
    struct Name {
        std::string operator()(double* /*field*/) const { return "NUMBER"; }
        std::string operator()(int* /*field*/) const { return "INTEGER"; }
        std::string operator()(std::uint64_t* /*field*/) const { return "INTEGER"; }
        std::string operator()(Bytes /*field*/) const { return "SIZE"; }
        std::string operator()(const Choice& choice) const {
            return fmt::format("{}", fmt::join(choice.names, "|"));
        }
        std::string operator()(bool* /*field*/) const { return ""; }
        std::string operator()(std::string* /*field*/) const { return "PATH"; }
        std::string operator()(std::vector<std::string>* /*field*/) const { return "NAME,..."; }
    };
    Job job;
    return parameter.range.starts_with("a condition") ? "CONDITION"
                                                      : std::visit(Name{}, parameter.field(job));
}

/// Help, then unit, range and default on a line of their own.
std::string description(const Parameter& parameter) {
    const std::string value = format_value(parameter, Job{});
    std::string facts = parameter.unit.empty() ? "" : fmt::format("{}; ", parameter.unit);
    facts += parameter.range;
    if (parameter.required) {
        facts += "; required";
    } else if (parameter.target) {
        facts += "; one of --alpha, --tolerance, --ratio, --count is required";
    } else if (!value.empty()) {
        facts += fmt::format("; default {}", value);
    }
    return fmt::format("{}\n[{}]", parameter.help, facts);
}

std::string group_of(const Parameter& parameter) {
    return fmt::format("Parameters: {}", parameter.key.substr(0, parameter.key.find('.')));
}

bool is_input(const Parameter& parameter) {
    return !parameter.flag.starts_with("--");
}

/// The target of a job file makes room for one on the command line.
void clear_target(Job& job, const Parameter& parameter) {
    const ParameterField field = parameter.field(job);
    if (double* const* number = std::get_if<double*>(&field)) {
        **number = 0;
    } else if (std::uint64_t* const* count = std::get_if<std::uint64_t*>(&field)) {
        **count = 0;
    }
}

void apply_setting(Job& job, const std::string& setting) {
    const std::size_t equals = setting.find('=');
    if (equals == std::string::npos) {
        throw ConfigError(fmt::format("--set: expected KEY=VALUE, found \"{}\"", setting));
    }
    const std::string key = setting.substr(0, equals);
    set_parameter(job, find_parameter(key, "--set"), setting.substr(equals + 1), "--set " + key);
}

}  // namespace

JobOptions::JobOptions(CLI::App& command, Input input)
    : input_(input), texts_(parameters().size()), flags_(parameters().size(), nullptr) {
    if (input == Input::kFiles) {
        command
            .add_option("IN", positional_, "files, folders and globs: one archive, in this order")
            ->type_name("");
    } else {
        const bool files = input == Input::kJobOrFiles;
        command
            .add_option(
                files ? "JOB.toml|IN" : "JOB.toml", positional_,
                files ? "a job file; or files, folders and globs"
                      : "the job file; relative paths in it are relative to the current folder")
            ->type_name("");
        command.add_option("--set", settings_, "set a key of the job: --set range.alpha=0.4")
            ->type_name("KEY=VALUE")
            ->allow_extra_args(false);
        command
            .add_option("--input", input_flags_,
                        "read this instead of the input of the job; may be repeated")
            ->type_name("PATH")
            ->allow_extra_args(false);
    }
    if (input != Input::kJobOrFiles) {
        command
            .add_flag("--resume", resume_,
                      "go on where an earlier run of the same job stopped; done without the flag\n"
                      "too, unless --restart is given")
            ->group("Unfinished runs");
        command
            .add_flag("--restart", restart_,
                      "throw away what an unfinished run of the same output left")
            ->group("Unfinished runs");
    }
    command
        .add_option("--preset", preset_,
                    "paper: the method as published; accurate: closest to the surface; other\n"
                    "flags of curvature and range win")
        ->type_name("paper|accurate");
    add_flags(command);
}

void JobOptions::add_flags(CLI::App& command) {
    for (std::size_t i = 0; i < parameters().size(); ++i) {
        const Parameter& parameter = parameters()[i];
        if (is_input(parameter)) {
            continue;
        }
        std::string names(parameter.flag);
        if (parameter.flag == "--output") {
            names.insert(0, "-o,");
        }
        const std::string text = description(parameter);
        Job job;
        if (std::holds_alternative<bool*>(parameter.field(job))) {
            flags_[i] = command.add_flag(names, text);
        } else {
            flags_[i] = command.add_option(names, texts_[i], text)->type_name(type_name(parameter));
        }
        flags_[i]->group(group_of(parameter));
    }
}

bool JobOptions::gives_target() const {
    for (std::size_t i = 0; i < flags_.size(); ++i) {
        const Parameter& parameter = parameters()[i];
        const std::string setting = std::string(parameter.key) + "=";
        const bool is_set =
            std::any_of(settings_.begin(), settings_.end(),
                        [&](const std::string& s) { return s.starts_with(setting); });
        if (parameter.target && (is_set || (flags_[i] != nullptr && flags_[i]->count() > 0))) {
            return true;
        }
    }
    return false;
}

Job JobOptions::job() const {
    const bool has_job =
        input_ == Input::kJob || (input_ == Input::kJobOrFiles && positional_.size() == 1 &&
                                  positional_[0].ends_with(".toml"));
    if (input_ == Input::kJob && positional_.size() != 1) {
        throw ConfigError(fmt::format("run: expected one job file, found {}", positional_.size()));
    }
    Job job = has_job ? read_job_file(positional_[0]) : Job{};
    if (!preset_.empty()) {
        apply_preset(job, preset_);
    }
    if (gives_target()) {
        for (const Parameter& parameter : parameters()) {
            if (parameter.target) {
                clear_target(job, parameter);
            }
        }
    }
    for (const std::string& setting : settings_) {
        apply_setting(job, setting);
    }
    for (std::size_t i = 0; i < flags_.size(); ++i) {
        const Parameter& parameter = parameters()[i];
        if (flags_[i] == nullptr || flags_[i]->count() == 0) {
            continue;
        }
        const bool is_flag = flags_[i]->get_expected_max() == 0;
        // A flag may have a value too: a preset sets some that one wants to take back.
        const std::string text = is_flag ? flags_[i]->results().back() : texts_[i];
        set_parameter(job, parameter, text, parameter.flag);
    }
    if (!has_job) {
        job.input = positional_;
    }
    if (!input_flags_.empty()) {
        job.input = input_flags_;
    }
    if (resume_ && restart_) {
        throw ConfigError("--resume, --restart: expected one of the two, found both");
    }
    job.restart = restart_;
    return job;
}

void add_progress_options(CLI::App& command, ProgressOptions& options) {
    command
        .add_option("--progress", options.mode,
                    "auto: bars on a terminal, else a line a stage; plain: a line a stage;\n"
                    "json: lines {\"stage\", \"points\", \"total\", \"points_per_second\",\n"
                    "\"seconds_left\"}; all on standard error")
        ->type_name("auto|plain|json")
        ->group("Progress");
    command.add_flag("-q,--quiet", options.quiet, "nothing on standard error but errors")
        ->group("Progress");
}

void add_output_file_options(CLI::App& command, OutputFileOptions& options,
                             const std::string& endings) {
    command.add_option("-o,--output", options.path, "the file to write: " + endings)
        ->type_name("FILE");
    command.add_flag("--overwrite", options.overwrite, "replace the file if it exists");
}

void check_output_file(const OutputFileOptions& options) {
    const std::filesystem::path path(options.path);
    if (options.path.empty()) {
        throw ConfigError("--output: expected a file, found none");
    }
    std::error_code ignored;
    if (std::filesystem::is_directory(path, ignored)) {
        throw ConfigError(
            fmt::format("{}: expected a file to write, found a folder", options.path));
    }
    if (std::filesystem::exists(path, ignored) && !options.overwrite) {
        throw ConfigError(fmt::format("{}: exists (needs --overwrite)", options.path));
    }
    const std::filesystem::path parent = path.has_parent_path() ? path.parent_path() : ".";
    if (::access(parent.c_str(), W_OK | X_OK) != 0) {
        throw ConfigError(fmt::format(
            "{}: expected a folder to write to, found none that is writable", parent.string()));
    }
}

}  // namespace knap::app
