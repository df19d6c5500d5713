"""A client that logs in again on its open connection: sections 3 and 5 of docs/protocol.md."""


class Renewals:
    def __init__(self):
        super().__init__()
        self.renewals = []  # whether each was accepted

    def renew(self, credential, method="token"):
        before = len(self.renewals)
        self.send_control(type="renew", method=method, credential=credential)
        self.until(lambda: len(self.renewals) > before, "an answer to the renewal")
        return self.renewals[-1]

    def _on_renewed(self, message):
        self.renewals.append(message["accepted"])
