#include "app/completion.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <string_view>
#include <vector>

#include "knap/params.hpp"

namespace knap::app {

namespace {

// What a word is, and where words are split at "=" as bash does it.
constexpr const char* kHead = R"(# bash completion of knap, made from its own flags
_knap() {
    local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]}
    local flags='' words='' files='' nospace=''
    COMPREPLY=()
    if [[ $word == '=' ]]; then
        word=''
    elif [[ $before == '=' ]]; then
        before=${COMP_WORDS[COMP_CWORD - 2]}
    fi
)";

constexpr const char* kTail = R"(    if [[ $word == -* ]]; then
        words=$flags files=''
    fi
    if [[ -n $files ]]; then
        compopt -o default
        return
    fi
    if [[ -n $nospace ]]; then
        compopt -o nospace
    fi
    mapfile -t COMPREPLY < <(compgen -W "$words" -- "$word")
}
complete -F _knap knap
)";

std::string keys() {
    std::string result;
    for (const Parameter& parameter : parameters()) {
        result += fmt::format("{}{}=", result.empty() ? "" : " ", parameter.key);
    }
    return result;
}

/// What a value of this type is completed by, as an assignment of the script.
std::string completed_by(std::string type) {
    if (type == "KEY=VALUE") {
        return fmt::format("words='{}' nospace=1", keys());
    }
    if (type.find('|') != std::string::npos) {
        std::replace(type.begin(), type.end(), '|', ' ');
        return fmt::format("words='{}'", type);
    }
    const bool is_file = type.empty() || type == "PATH" || type == "FILE" || type == "FOLDER";
    return is_file ? "files=1" : "words=''";
}

std::string branch(const CLI::App& command) {
    std::vector<std::string> flags;
    std::map<std::string, std::vector<std::string>> by_completion;
    std::string positional = "words=''";
    for (const CLI::Option* option : command.get_options()) {
        if (option->get_positional()) {
            positional = completed_by(option->get_type_name());
            continue;
        }
        const std::vector<std::string> names = flag_names(*option);
        flags.insert(flags.end(), names.begin(), names.end());
        if (option->get_expected_max() > 0) {
            std::vector<std::string>& same = by_completion[completed_by(option->get_type_name())];
            same.insert(same.end(), names.begin(), names.end());
        }
    }
    std::string result = fmt::format("    {})\n        flags='{}'\n        case $before in\n",
                                     command.get_name(), fmt::join(flags, " "));
    for (const auto& [completion, names] : by_completion) {
        result += fmt::format("        {}) {} ;;\n", fmt::join(names, " | "), completion);
    }
    return result + fmt::format("        *) {} ;;\n        esac\n        ;;\n", positional);
}

}  // namespace

std::string bash_completion(const Program& program) {
    std::string script = kHead;
    std::string commands;
    for (const Command& command : program.commands) {
        commands += command.parser->get_name() + " ";
    }
    script +=
        "    case $((COMP_CWORD > 1)),${COMP_WORDS[1]} in\n"
        "    0,*)\n"
        "        flags='-h --help --version'\n";
    script += fmt::format("        words='{}'\n        ;;\n", commands);
    for (const Command& command : program.commands) {
        script += "    1," + branch(*command.parser).substr(4);
    }
    return script + "    esac\n" + kTail;
}

}  // namespace knap::app
