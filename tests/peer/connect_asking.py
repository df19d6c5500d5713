"""Section 5 of docs/protocol.md, `ask` and `answer`: why something is not offered."""

from connect_records import ILLEGAL, require


class Asking:
    """What a peer asks and is asked."""

    def __init__(self):
        super().__init__()
        self.asked_for = []  # by the other end, in their order
        self.answer_with = "absent"
        self.answers = []  # of the other end
        self._questions = []  # how many names each question has that is not answered

    def ask(self, *names):
        """Asks for (kind, name, type) each."""
        self._questions.append(len(names))
        self.send_control(
            type="ask", names=[dict(kind=kind, name=name, type=of) for kind, name, of in names]
        )

    def codes_for(self, *names):
        """What the other end answers."""
        before = len(self.answers)
        self.ask(*names)
        self.until(lambda: len(self.answers) > before, "an answer")
        return self.answers[before]

    def _on_ask(self, message):
        names = [(asked["kind"], asked["name"], asked["type"]) for asked in message["names"]]
        self.asked_for += names
        self.send_control(type="answer", codes=[self.answer_with] * len(names))

    def _on_answer(self, message):
        require(self._questions, "an answer to nothing", ILLEGAL)
        require(self._questions.pop(0) == len(message["codes"]), "another number", ILLEGAL)
        self.answers.append(message["codes"])
