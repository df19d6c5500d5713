"""What tools/tidy reads out of C++."""

import re


def without_comments(text, keep_strings=False):
    """The code with comments (and strings) blanked, lines kept."""
    pattern = re.compile(
        r'//[^\n]*|/\*.*?\*/|R"(?P<d>[^(\s]*)\(.*?\)(?P=d)"|"(?:\\.|[^"\\\n])*"'
        r"|(?<![0-9A-Za-z_])'(?:\\.|[^'\\\n])+'", re.S)

    def blank(match):
        found = match.group(0)
        if keep_strings and not found.startswith('/'):
            return found
        return re.sub(r'[^\n]', ' ', found)
    return pattern.sub(blank, text)


def functions(text):
    """(name, first line, number of lines) of every function body at namespace or class scope."""
    code = re.sub(r'^\s*#.*?(?<!\\)$', lambda m: re.sub(r'[^\n]', ' ', m.group(0)),
                  without_comments(text), flags=re.M | re.S)
    stack, statement, start = [], '', None
    line = 1
    for at, char in enumerate(code):
        if char == '\n':
            line += 1
        if char == '{':
            outside = all(kind in ('namespace', 'type') for kind, *_ in stack)
            if not outside:
                kind = 'inside'
            elif re.search(r'\bnamespace\b|\bextern\b', statement):
                kind = 'namespace'
            elif at and (code[at - 1].isalnum() or code[at - 1] in '_>') and ')' in statement:
                kind = 'initializer'
            elif re.search(r'\b(class|struct|union|enum)\b', statement) and '(' not in statement:
                kind = 'type'
            elif '(' in statement:
                kind = 'function'
            else:
                kind = 'inside'
            stack.append((kind, statement, start or line))
            if kind != 'initializer':
                statement, start = '', None
        elif char == '}':
            kind, heading, first = stack.pop() if stack else ('inside', '', line)
            if kind == 'function':
                name = re.search(r'([~\w:]+|operator[^(]*)\s*\(', heading)
                yield (name.group(1).strip() if name else '?', first, line - first + 1)
            if kind == 'initializer':
                statement, start = heading, first
            else:
                statement, start = '', None
        elif char == ';' and not (stack and stack[-1][0] == 'inside'):
            statement, start = '', None
        else:
            if start is None and not char.isspace():
                start = line
            statement += char


def members(text):
    """(line, declaration) of every statement at class scope that has no body."""
    code = re.sub(r'^\s*#.*$', '', without_comments(text), flags=re.M)
    stack, statement, start, line = [], '', 1, 1
    for char in code:
        line += char == '\n'
        in_type = bool(stack) and stack[-1][0] == 'type'
        if char == '{':
            is_type = re.search(r'\b(class|struct|union)\b[^();]*$', statement)
            is_scope = is_type or re.search(r'\bnamespace\b', statement)
            stack.append(('type' if is_type else 'scope' if is_scope else 'inside', statement))
            statement = ''
        elif char == '}':
            kind, heading = stack.pop() if stack else ('inside', '')
            # An initializer in braces belongs to its member; a body ends a function.
            statement = heading if kind == 'inside' and '(' not in heading else ''
        elif char == ';':
            if in_type:
                words = re.sub(r'\b(public|private|protected)\s*:', '', statement)
                yield start, ' '.join(words.split())
            statement = ''
        elif not (stack and stack[-1][0] == 'inside'):
            start = start if statement.strip() else line
            statement += char


def references(text):
    """(line, type, name) of every member that refers to an object that is another's."""
    words = r'(?:mutable |static |const )*'
    for line, member in members(text):
        match = re.fullmatch(words + r'([\w:]+)(<[^()]*>)?(?: const)? ?[&*]+ ?(?:const )?(\w+)'
                             r'(?: =.*)?', member)
        if match:
            yield line, match.group(1), match.group(3)
        match = re.search(r'\breference_wrapper<(?:const )?([\w:]+)[^()]* (\w+)$', member)
        if match:
            yield line, match.group(1), match.group(2)


def slices(units, tested):
    """Headers that one other unit alone includes, or none, and no test: {header: that unit}.

    `units`: the headers of the project that each includes, its own among them.
    """
    users = {header: set() for headers in units.values() for header in headers}
    users.update({f'{unit}.hpp': set() for unit in units})
    for unit, headers in units.items():
        for header in headers - {f'{unit}.hpp'}:
            users[header].add(unit)
    return {header: ''.join(users) for header, users in users.items()
            if len(users) <= 1 and header not in tested}


def self_test():
    """Yields what the two functions above do not find, or find where it is not."""
    text = """
        namespace n {
        class Offers;  // Offers& none_;
        class Cut : public Base {
         public:
          explicit Cut(Offers& offers) : offers_(offers) {}
          Offers& operator=(const Offers&) = delete;
          void on(Offers* other) { Offers& local = *other; use(local); }
          Offers& owner();
         private:
          struct Row { const Key* key = nullptr; };
          Offers& offers_;
          const std::map<Link, Offer>* const all_{nullptr};
          mutable std::vector<Offers*> list_;
          std::function<void(Offers&)> call_;
          std::reference_wrapper<Offers> wrapped_;
          int count_ = 0;
        };
        Offers& global();
        }"""
    names = [name for _, _, name in references(text)]
    if names != ['key', 'offers_', 'all_', 'wrapped_']:
        yield f'references: finds {names}'
    if [line for line, *_ in references(text)][1:2] != [12]:
        yield 'references: finds them in another line'
    found = slices({'a/one': {'a/part.hpp', 'a/noun.hpp', 'a/both.hpp', 'a/one.hpp'},
                    'a/part': {'a/part.hpp'}, 'a/two': {'a/both.hpp', 'a/one.hpp'},
                    'a/three': {'a/one.hpp', 'a/two.hpp'}, 'a/dead': set()},
                   {'a/noun.hpp', 'a/two.hpp', 'a/three.hpp'})
    if found != {'a/part.hpp': 'a/one', 'a/dead.hpp': ''}:
        yield f'slices: finds {found}'
